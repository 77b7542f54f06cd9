//! The shader files: printed from Rust, complete, and valid.

use std::fs;
use std::path::Path;

use offtrack::stages::SHADERS;

#[test]
fn the_printed_layout_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders/layout.wgsl");
    let printed = offtrack::wgsl::layout();
    if std::env::var_os("PRINT_LAYOUT").is_some() {
        fs::write(&path, &printed).unwrap();
    }
    assert!(
        fs::read_to_string(&path).unwrap() == printed,
        "run `PRINT_LAYOUT=1 cargo test --release printed_layout` and look at the change"
    );
}

#[test]
fn every_shader_file_is_part_of_the_module() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut found = Vec::new();
    for folder in ["", "common"] {
        for entry in fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                found.push(path.strip_prefix(&root).unwrap().with_extension("").to_str().unwrap().to_owned());
            }
        }
    }
    found.sort_unstable();
    let mut known: Vec<&str> = SHADERS.iter().map(|(name, _)| *name).collect();
    known.sort_unstable();
    assert_eq!(found, known);
}

#[test]
fn every_shader_of_a_stage_has_a_twin_on_the_cpu_and_every_twin_a_shader() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/engine/cpu");
    let mut found: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().to_str().unwrap().replace(".rs", "")).collect();
    found.sort_unstable();
    let mut known: Vec<&str> =
        SHADERS.iter().map(|(name, _)| *name).filter(|name| *name != "layout" && !name.starts_with("common/")).collect();
    known.sort_unstable();
    assert_eq!(found, known);
}

#[cfg(feature = "gpu")]
mod module {
    use offtrack::layout::structs;
    use offtrack::shared::Named;
    use offtrack::shared::Struct;
    use offtrack::stages::{Kernel, SHADERS, STAGES};
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
    use wgpu::naga::{Module, TypeInner, front::wgsl};

    fn parsed(source: &str) -> Module {
        wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)))
    }

    fn module() -> Module {
        parsed(&SHADERS.iter().flat_map(|(_, text)| [*text, "\n"]).collect::<String>())
    }

    #[test]
    fn the_module_is_valid_and_has_every_kernel() {
        let module = module();
        Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).unwrap();
        let mut found: Vec<&str> = module.entry_points.iter().map(|entry| entry.name.as_str()).collect();
        let mut known: Vec<&str> = Kernel::ALL.iter().map(|kernel| kernel.name()).collect();
        found.sort_unstable();
        known.sort_unstable();
        assert_eq!(found, known);
        let of_stages: Vec<Kernel> = STAGES.iter().flat_map(|stage| stage.kernels()).copied().collect();
        let beside = [Kernel::Draw, Kernel::Begin, Kernel::ObserveBegun];
        assert!(Kernel::ALL.iter().all(|kernel| beside.contains(kernel) != of_stages.contains(kernel)), "a kernel without a stage");
    }

    /// Differences between the layouts of WGSL and of Rust, struct by struct.
    fn differences(module: &Module) -> Vec<String> {
        let mut differences = Vec::new();
        for Struct { name, size, fields } in structs() {
            let fields: Vec<(&str, usize)> = fields.iter().map(|field| (field.name, field.offset)).collect();
            let found = module.types.iter().find(|(_, kind)| kind.name.as_deref() == Some(name));
            let Some((_, TypeInner::Struct { members, span })) = found.map(|(_, kind)| (name, &kind.inner)) else {
                differences.push(format!("{name} is missing"));
                continue;
            };
            if *span as usize != size {
                differences.push(format!("{name} takes {span} bytes instead of {size}"));
            }
            let offsets: Vec<(&str, usize)> =
                members.iter().map(|member| (member.name.as_deref().unwrap_or_default(), member.offset as usize)).collect();
            if offsets != fields {
                differences.push(format!("{name}: {offsets:?} instead of {fields:?}"));
            }
        }
        differences
    }

    #[test]
    fn every_field_is_where_wgsl_looks_for_it() {
        assert_eq!(differences(&module()), Vec::<String>::new());
        assert!(15 <= structs().len());
        // The comparison notices fields that moved and a struct that grew.
        let layout = SHADERS[0].1;
        let grown = layout.replacen("    tractor: f32,\n", "    tractor: vec2<f32>,\n", 1);
        assert_ne!(layout, grown);
        assert_eq!(differences(&parsed(&grown)).len(), 2);
    }
}
