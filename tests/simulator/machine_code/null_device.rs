//! Kernels compiled for a graphics card that need not be there.
//!
//! RADV, the Vulkan driver of Mesa for AMD's cards, opens a device without hardware when it is told a chip's name, and
//! prints what its compiler made of each pipeline. Both are asked for by environment variables, which only a child
//! process gets: the test runs itself again.

#![expect(unsafe_code, reason = "wgpu opens no device without memory; what is below it does, and is unsafe to call")]

use std::borrow::Cow;
use std::path::PathBuf;
use std::process::Command;

use wgpu::hal::api::Vulkan;
use wgpu::hal::{
    Adapter as _, Api, BindGroupLayoutDescriptor, BindGroupLayoutFlags, ComputePipelineDescriptor, Device as _,
    ExposedAdapter, Instance as _, InstanceDescriptor, NagaShader, PipelineLayoutDescriptor, PipelineLayoutFlags,
    ProgrammableStage, ShaderInput, ShaderModuleDescriptor,
};
use wgpu::naga::front::wgsl::parse_str;
use wgpu::naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use wgpu::naga::{AddressSpace, GlobalVariable, Module, StorageAccess};
use wgpu::{
    BindGroupLayoutEntry, BindingType, BufferBindingType, Features, InstanceFlags, MemoryHints, ShaderRuntimeChecks,
    ShaderStages,
};

/// The chip compiled for, as Mesa's versions name it: RDNA 3, as in a Radeon RX 7900.
const CHIPS: [&str; 2] = ["navi31", "gfx1100"];
/// Threads in a subgroup of this driver's compute shaders.
const SUBGROUP: u32 = 64;
/// Workgroup memory that any device offers (bytes).
const WORKGROUP_MEMORY: u32 = 16_384;
/// Set in the child process.
const CHILD: &str = "OFFTRACK_COMPILES_FOR_NO_CARD";
/// Before the driver's name and version.
const DRIVER: &str = "driver: ";
/// Before a kernel's name and its statistics.
const MARK: &str = "kernel: ";

/// What the compiler made of a kernel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Code {
    /// The entry point.
    pub kernel: String,
    /// Vector registers a thread.
    pub vgprs: u32,
    /// Vector registers that did not fit and lie in memory.
    pub spilled_vgprs: u32,
    /// Scalar registers that did not fit.
    pub spilled_sgprs: u32,
    /// Workgroup memory (bytes a workgroup).
    pub workgroup_memory: u32,
    /// Memory of a thread's own, for arrays indexed by what is not constant (bytes a thread).
    pub scratch: u32,
    /// Subgroups that one unit of the chip holds at a time.
    pub subgroups: u32,
    /// Instructions in the code.
    pub instructions: u32,
}

/// What a kernel's code may take at most. Nothing may be spilled.
#[derive(Debug, Clone, Copy)]
pub struct Stated {
    /// The entry point.
    pub kernel: &'static str,
    /// Vector registers a thread.
    pub vgprs: u32,
    /// Workgroup memory (bytes a workgroup).
    pub workgroup_memory: u32,
    /// Memory of a thread's own (bytes a thread).
    pub scratch: u32,
}

/// What a kernel's code may take at most, in the order of [`Stated`].
pub const fn stated(kernel: &'static str, vgprs: u32, workgroup_memory: u32, scratch: u32) -> Stated {
    Stated { kernel, vgprs, workgroup_memory, scratch }
}

impl Stated {
    /// What of a kernel's code is above it.
    pub fn above(&self, code: &Code) -> Vec<String> {
        let found = [
            ("vector registers", code.vgprs, self.vgprs),
            ("spilled vector registers", code.spilled_vgprs, 0),
            ("spilled scalar registers", code.spilled_sgprs, 0),
            ("bytes of workgroup memory", code.workgroup_memory, self.workgroup_memory.min(WORKGROUP_MEMORY)),
            ("bytes of scratch a thread", code.scratch, self.scratch),
        ];
        let above = found.iter().filter(|(_, found, most)| most < found);
        above.map(|(what, found, most)| format!("{}: {found} {what}, {most} stated", self.kernel)).collect()
    }
}

/// Checks the kernels of the module `source` against what is stated of each, and prints their code's numbers. `test` is
/// the name of the test that asks.
pub fn check(test: &str, source: &str, stated: &[Stated]) {
    let kernels: Vec<&str> = stated.iter().map(|stated| stated.kernel).collect();
    let Some(codes) = codes(test, source, &kernels) else { return };
    codes.iter().for_each(|code| println!("{code:?}"));
    let above: Vec<String> = stated.iter().zip(&codes).flat_map(|(stated, code)| stated.above(code)).collect();
    assert_eq!(above, Vec::<String>::new());
}

/// The code of `kernels` of the module `source`, for the chip; nothing where this machine's driver cannot compile for
/// it, which is an error where the variable `CI` is set. `test` is the name of the test that asks: the child process
/// runs it again, and ends here.
pub fn codes(test: &str, source: &str, kernels: &[&str]) -> Option<Vec<Code>> {
    if std::env::var_os(CHILD).is_some() {
        compile(source, kernels);
    }
    let printed = match printed(test) {
        Ok(printed) => printed,
        Err(reason) => {
            let message = format!("{reason}; on Debian and Ubuntu the package mesa-vulkan-drivers up to Mesa 25 does");
            assert!(std::env::var_os("CI").is_none(), "{message}");
            println!("not checked: {message}");
            return None;
        }
    };
    printed.lines().filter(|line| line.starts_with(DRIVER)).for_each(|line| println!("{line}"));
    let codes: Vec<Code> = printed.split(MARK).skip(1).map(parsed).collect();
    let names: Vec<&str> = codes.iter().map(|code| code.kernel.as_str()).collect();
    assert_eq!(names, kernels, "{printed}");
    Some(codes)
}

/// What a child process prints that runs `test` on the device without hardware, or why none does.
fn printed(test: &str) -> Result<String, String> {
    let drivers = drivers();
    if drivers.is_empty() {
        return Err("no driver of this machine compiles for a card that is not there".to_owned());
    }
    let mut said = String::new();
    for chip in CHIPS {
        let child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", test, "--nocapture"])
            .env(CHILD, "1")
            .env("RADV_FORCE_FAMILY", chip)
            .env("RADV_DEBUG", "shaderstats")
            .env_remove("RADV_PERFTEST")
            .env("MESA_SHADER_CACHE_DISABLE", "true")
            .env("VK_DRIVER_FILES", std::env::join_paths(&drivers).unwrap())
            .output()
            .unwrap();
        let printed = String::from_utf8_lossy(&child.stderr).into_owned();
        if printed.contains(MARK) {
            assert!(child.status.success(), "{chip}: {}\n{printed}", child.status);
            return Ok(printed);
        }
        said += &format!("\n{chip}: {}\n{printed}", child.status);
    }
    Err(format!("the driver compiles for no chip of {CHIPS:?}:{said}\n"))
}

/// The descriptions of the driver in the places where a Vulkan loader looks for them.
fn drivers() -> Vec<PathBuf> {
    let folders = ["/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
    let files = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    let is_radv =
        |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("radeon_icd"));
    files.map(|file| file.path()).filter(is_radv).collect()
}

/// Compiles kernels for the first adapter, as `Device::create_compute_pipeline` does, and says before each which it is.
///
/// What is below wgpu does it: wgpu itself opens no device without memory. The process ends here, before anything is
/// dropped that the device refers to.
fn compile(source: &str, kernels: &[&str]) -> ! {
    let descriptor = InstanceDescriptor {
        name: "machine code",
        flags: InstanceFlags::empty(),
        memory_budget_thresholds: Default::default(),
        backend_options: Default::default(),
        telemetry: None,
        display: None,
    };
    let module = parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module).unwrap();
    let layouts = kernels.iter().map(|kernel| entries(&module, &info, kernel)).collect::<Vec<_>>();
    // Sound: the device is open to the end of the process, all that is created is valid, and nothing is submitted.
    unsafe {
        let instance = <Vulkan as Api>::Instance::init(&descriptor).unwrap();
        let ExposedAdapter { adapter, info: driver, features, capabilities } =
            instance.enumerate_adapters(None).remove(0);
        let features = features - Features::MAPPABLE_PRIMARY_BUFFERS - Features::all_experimental_mask();
        eprintln!("{DRIVER}{} {}", driver.driver, driver.driver_info);
        let device = adapter.open(features, &capabilities.limits, &MemoryHints::default()).unwrap().device;
        let shader = NagaShader { module: Cow::Owned(module), info, debug_source: None };
        let descriptor = ShaderModuleDescriptor { label: None, runtime_checks: ShaderRuntimeChecks::checked() };
        let module = device.create_shader_module(&descriptor, ShaderInput::Naga(shader)).unwrap();
        for (kernel, entries) in kernels.iter().zip(&layouts) {
            let flags = BindGroupLayoutFlags::empty();
            let group = BindGroupLayoutDescriptor { label: None, flags, entries };
            let group = device.create_bind_group_layout(&group).unwrap();
            let layout = device
                .create_pipeline_layout(&PipelineLayoutDescriptor {
                    label: None,
                    flags: PipelineLayoutFlags::empty(),
                    bind_group_layouts: &[Some(&group)],
                    immediate_size: 0,
                })
                .unwrap();
            eprintln!("{MARK}{kernel}");
            device
                .create_compute_pipeline(&ComputePipelineDescriptor {
                    label: None,
                    layout: &layout,
                    stage: ProgrammableStage {
                        module: &module,
                        entry_point: kernel,
                        constants: &Default::default(),
                        zero_initialize_workgroup_memory: true,
                    },
                    cache: None,
                })
                .unwrap();
        }
        std::process::exit(0);
    }
}

/// The buffers that a kernel names.
fn entries(module: &Module, info: &ModuleInfo, kernel: &str) -> Vec<BindGroupLayoutEntry> {
    let index = module.entry_points.iter().position(|entry| entry.name == kernel);
    let used = info.get_entry_point(index.unwrap_or_else(|| panic!("there is no kernel {kernel}")));
    let named = module.global_variables.iter().filter(|(handle, _)| !used[*handle].is_empty());
    let entry = |(_, variable): (_, &GlobalVariable)| {
        let ty = match variable.space {
            AddressSpace::Uniform => BufferBindingType::Uniform,
            AddressSpace::Storage { access } => {
                BufferBindingType::Storage { read_only: !access.contains(StorageAccess::STORE) }
            }
            _ => return None,
        };
        Some(BindGroupLayoutEntry {
            binding: variable.binding?.binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        })
    };
    named.filter_map(entry).collect()
}

/// A kernel's name and the statistics that the driver printed behind it.
fn parsed(printed: &str) -> Code {
    let (kernel, lines) = printed.split_once('\n').unwrap();
    let value = |name: &str| -> u32 {
        let line = lines.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
        let line = line.unwrap_or_else(|| panic!("the driver does not say `{name}`:\n{printed}"));
        line.split(' ').next().unwrap().parse().unwrap()
    };
    Code {
        kernel: kernel.to_owned(),
        vgprs: value("VGPRs"),
        spilled_vgprs: value("Spilled VGPRs"),
        spilled_sgprs: value("Spilled SGPRs"),
        workgroup_memory: value("LDS size"),
        scratch: value("Scratch size") / SUBGROUP,
        subgroups: value("Subgroups per SIMD"),
        instructions: value("Instructions"),
    }
}
