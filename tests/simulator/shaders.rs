//! The shader files: printed from Rust, complete, valid, and free of what one of the compilers of WGSL takes amiss.

use std::fs;
use std::path::Path;

use offtrack::engine::stages::SHADERS;

#[test]
fn the_printed_layout_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders/layout.wgsl");
    let printed = offtrack::engine::wgsl::layout();
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
    for folder in ["", "common", "traffic"] {
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
    let mut found: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_str().unwrap().replace(".rs", ""))
        .collect();
    found.sort_unstable();
    // A stage may have a folder of its tests.
    found.dedup();
    let mut known: Vec<&str> = SHADERS
        .iter()
        .map(|(name, _)| *name)
        // One does several stages at once.
        .filter(|name| !["layout", "advance"].contains(name) && !name.contains('/'))
        .collect();
    known.sort_unstable();
    assert_eq!(found, known);
}

/// Every shader file of the simulator, of policies and of the learner: its path, and its text.
fn shaders() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut shaders = Vec::new();
    for folder in ["shaders", "shaders/common", "shaders/traffic", "policy/shaders", "learner/shaders"] {
        for entry in fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "wgsl") {
                shaders.push((path.display().to_string(), fs::read_to_string(&path).unwrap()));
            }
        }
    }
    assert_eq!(shaders.len(), SHADERS.len() + 7);
    shaders
}

/// A shader without its comments.
fn code(text: &str) -> String {
    text.lines().map(|line| line.split_once("//").map_or(line, |(code, _)| code)).collect::<Vec<_>>().join("\n")
}

/// The numbers in a shader's code, as they are written.
fn numbers(code: &str) -> Vec<&str> {
    let of_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    let mut numbers = Vec::new();
    let mut rest = code;
    while let Some(start) = rest.find(of_name) {
        let word = &rest[start..];
        let is_number = word.starts_with(|letter: char| letter.is_ascii_digit());
        let mut before = ' ';
        let end = word.find(|letter| {
            let is_sign_of_exponent = (letter == '-' || letter == '+') && before == 'e' && !word.starts_with("0x");
            before = letter;
            !(of_name(letter) || is_number && (letter == '.' || is_sign_of_exponent))
        });
        let (word, after) = word.split_at(end.unwrap_or(word.len()));
        if is_number {
            numbers.push(word);
        }
        rest = after;
    }
    numbers
}

/// Whether a number, read exactly and not rounded first, is within its type's range.
fn is_in_range(number: &str) -> bool {
    if let Some(hexadecimal) = number.strip_prefix("0x") {
        return u32::from_str_radix(hexadecimal.trim_end_matches('u'), 16).is_ok();
    }
    if let Some(whole) = number.strip_suffix('i') {
        return whole.parse::<i32>().is_ok();
    }
    match number.strip_suffix('u') {
        Some(whole) => whole.parse::<u32>().is_ok(),
        None => number.trim_end_matches('f').parse::<f64>().is_ok_and(|real| real.abs() <= f64::from(f32::MAX)),
    }
}

#[test]
fn no_number_of_a_shader_is_above_the_largest_f32_as_a_real_number() {
    let mut n_numbers = 0;
    for (file, text) in shaders() {
        let code = code(&text);
        for number in numbers(&code) {
            assert!(is_in_range(number), "{file}: {number}");
            n_numbers += 1;
        }
    }
    assert!(400 < n_numbers, "{n_numbers}");
    // What a decimal that is rounded to the nearest f32 may look like.
    assert_eq!(
        numbers("const A1: f32 = 3.4028235e38f; let b = -0.5e-3 + 0xffffu - x.y2;"),
        ["3.4028235e38f", "0.5e-3", "0xffffu"]
    );
    assert!(
        !is_in_range("3.4028235e38f") && !is_in_range("4294967296u") && is_in_range("0.5e-3") && is_in_range("0xffffu")
    );
}

#[test]
fn no_comment_of_a_shader_has_two_spaces_in_a_row_or_a_link_of_rust() {
    let mut n_comments = 0;
    for (file, text) in shaders() {
        for comment in text.lines().filter_map(|line| line.split_once("//")).map(|(_, comment)| comment) {
            let is_plain = !["  ", "[`", "](", "\\[", "crate::"].iter().any(|mark| comment.contains(mark));
            assert!(is_plain, "{file}: {comment}");
            n_comments += 1;
        }
    }
    assert!(400 < n_comments, "{n_comments}");
}

/// Declarations of variables without an initial value in the loops of a shader's code.
fn without_value_in_loops(code: &str) -> Vec<String> {
    let is_bare = |statement: &str| statement.starts_with("var") && !statement.contains('=');
    let mut found = Vec::new();
    // For each open brace whether it is a loop's.
    let mut loops: Vec<bool> = Vec::new();
    let (mut statement, mut depth) = (String::new(), 0);
    for letter in code.chars() {
        depth += i32::from(letter == '(') - i32::from(letter == ')');
        let ends = depth == 0 && [';', '{', '}'].contains(&letter);
        if !ends {
            statement.push(letter);
            continue;
        }
        let head = statement.trim();
        let is_loop = letter == '{' && ["for", "while", "loop"].iter().any(|word| head.starts_with(word));
        // In the head of a loop the first statement is a declaration.
        let declared = if is_loop { head.split(['(', ';']).nth(1).unwrap_or_default() } else { head };
        if is_bare(declared.trim()) && (is_loop || loops.contains(&true)) {
            found.push(declared.to_owned());
        }
        match letter {
            '{' => loops.push(is_loop),
            '}' => drop(loops.pop()),
            _ => {}
        }
        statement.clear();
    }
    assert!(loops.is_empty() && depth == 0, "a brace is not closed");
    found
}

#[test]
fn in_a_loop_every_variable_has_an_initial_value_since_one_compiler_clears_it_only_once() {
    let mut n_loops = 0;
    for (file, text) in shaders() {
        let code = code(&text);
        n_loops += ["for (", "while ", "loop {"].iter().map(|word| code.matches(word).count()).sum::<usize>();
        assert_eq!(without_value_in_loops(&code), Vec::<String>::new(), "{file}");
    }
    assert!(15 < n_loops, "{n_loops}");
    let bad = "fn f() { var a: u32; for (var n: u32; n < 2u; n++) { if b { var c: array<u32, 2>; } var d = 0u; } \
               while a { var e: u32; } }";
    assert_eq!(without_value_in_loops(bad), ["var n: u32", "var c: array<u32, 2>", "var e: u32"]);
}

#[cfg(feature = "gpu")]
mod module {
    use offtrack::engine::stages::{BEGIN, Case, Kernel, N_STORAGE_BUFFERS, SHADERS, STAGES, WORKGROUP_MEMORY};
    use offtrack::layout::shared::Struct;
    use offtrack::layout::structs;
    use offtrack::simulator::Autoreset;
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
    use wgpu::naga::{GlobalVariable, Handle, Module, TypeInner, front::wgsl};

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
        let of_steps = [false, true].map(|all| {
            let autoreset = Autoreset::NextStep;
            let (extras, vehicles, around, grouped, aprons) = (true, all, all, all, all);
            let case = Case { disturbed: all, extras, vehicles, around, grouped, aprons, autoreset };
            case.step().collect::<Vec<Kernel>>()
        });
        for kernel in Kernel::ALL {
            let used = [of_stages.as_slice(), &of_steps[0], &of_steps[1], &BEGIN, &[Kernel::Draw]];
            assert!(used.iter().any(|kernels| kernels.contains(&kernel)), "{kernel:?} is never run");
        }
    }

    #[test]
    fn a_step_takes_few_kernels_and_more_only_where_there_is_more_to_do() {
        let n = |disturbed, extras, autoreset| {
            let count = |vehicles, around, aprons| {
                Case { disturbed, extras, vehicles, around, grouped: false, aprons, autoreset }.step().count()
            };
            let alone = count(false, false, false);
            assert_eq!([count(true, false, false), count(true, true, false)], [alone + 6, alone + 8]);
            assert_eq!([count(false, false, true), count(true, true, true)], [alone + 2, alone + 9]);
            alone
        };
        assert_eq!(n(false, false, Autoreset::SameStep), 8);
        assert_eq!(n(false, false, Autoreset::Disabled), 8);
        assert_eq!(n(false, false, Autoreset::NextStep), 9);
        assert_eq!(n(false, true, Autoreset::SameStep), 10);
        assert_eq!(n(true, true, Autoreset::SameStep), 14);
    }

    /// The buffers that a shader names for each kernel, in the order of their bindings.
    fn named(module: &Module) -> Vec<(String, Vec<u32>)> {
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(module).unwrap();
        let kernels = module.entry_points.iter().enumerate().map(|(index, entry)| {
            let used = info.get_entry_point(index);
            let of = |(handle, variable): (Handle<GlobalVariable>, &GlobalVariable)| {
                variable.binding.as_ref().filter(|_| !used[handle].is_empty()).map(|binding| binding.binding)
            };
            let mut bindings: Vec<u32> = module.global_variables.iter().filter_map(of).collect();
            bindings.sort_unstable();
            (entry.name.clone(), bindings)
        });
        kernels.collect()
    }

    #[test]
    fn a_kernel_is_bound_to_exactly_the_buffers_that_its_shader_names_and_to_few() {
        let of_shader = named(&module());
        for (name, bindings) in &of_shader {
            let kernel = Kernel::ALL.iter().find(|kernel| kernel.name() == name).unwrap();
            let declared: Vec<u32> = kernel.buffers().iter().map(|buffer| buffer.binding() as u32).collect();
            assert_eq!(&declared, bindings, "{name}");
        }
        // What every device of WebGPU has.
        assert_eq!(N_STORAGE_BUFFERS, wgpu::Limits::default().max_storage_buffers_per_shader_stage as usize);
    }

    #[test]
    fn no_kernel_needs_more_workgroup_memory_than_every_device_has() {
        let module = module();
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).unwrap();
        let mut layouts = wgpu::naga::proc::Layouter::default();
        layouts.update(module.to_ctx()).unwrap();
        for (index, entry) in module.entry_points.iter().enumerate() {
            let used = info.get_entry_point(index);
            let shared = module.global_variables.iter().filter(|(handle, variable)| {
                variable.space == wgpu::naga::AddressSpace::WorkGroup && !used[*handle].is_empty()
            });
            let n_bytes: u32 = shared.map(|(_, variable)| layouts[variable.ty].size).sum();
            println!("{}: {n_bytes} bytes", entry.name);
            assert!(n_bytes <= WORKGROUP_MEMORY, "{}: {n_bytes} bytes", entry.name);
        }
        assert!(WORKGROUP_MEMORY <= wgpu::Limits::default().max_compute_workgroup_storage_size);
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
            let offsets: Vec<(&str, usize)> = members
                .iter()
                .map(|member| (member.name.as_deref().unwrap_or_default(), member.offset as usize))
                .collect();
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
