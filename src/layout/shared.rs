//! Macros for what is written once and read twice: by Rust, and by WGSL in the words printed here.
//!
//! [`shared!`](crate::shared!) declares structs, `constants!` constants, [`named!`](crate::named!) closed lists of
//! names.

use glam::Vec2;

/// A type that WGSL has too.
pub trait Shared {
    /// The type's name in WGSL.
    fn wgsl() -> String;

    /// Name in WGSL of what a buffer of such values is an array of: arrays lie flat in it.
    fn element() -> String {
        Self::wgsl()
    }

    /// What each further index of such a buffer counts to, as ", 29"; empty where a value is one element.
    fn lengths() -> String {
        String::new()
    }
}

impl Shared for f32 {
    fn wgsl() -> String {
        "f32".to_owned()
    }
}

impl Shared for u32 {
    fn wgsl() -> String {
        "u32".to_owned()
    }
}

impl Shared for Vec2 {
    fn wgsl() -> String {
        "vec2<f32>".to_owned()
    }
}

impl<T: Shared, const N: usize> Shared for [T; N] {
    fn wgsl() -> String {
        format!("array<{}, {N}>", T::wgsl())
    }
    fn element() -> String {
        T::element()
    }
    fn lengths() -> String {
        format!(", {N}{}", T::lengths())
    }
}

/// A shared struct, described.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Struct {
    /// The struct's name.
    pub name: &'static str,
    /// The struct's size (bytes).
    pub size: usize,
    /// The struct's fields, in order and without gaps.
    pub fields: Vec<Field>,
}

/// A field of a shared struct.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// The field's name.
    pub name: &'static str,
    /// The field's offset in the struct (bytes).
    pub offset: usize,
    /// The field's type in WGSL: `f32`, `u32`, `vec2<f32>`, another struct or an array.
    pub wgsl: String,
    /// What it is, with its unit.
    pub doc: String,
}

/// A value that can be written as a WGSL literal.
pub trait Literal {
    /// The value's type in WGSL.
    fn type_name() -> String;
    /// The value as WGSL reads it, to the last bit.
    fn literal(&self) -> String;
}

impl Literal for f32 {
    fn type_name() -> String {
        f32::wgsl()
    }
    fn literal(&self) -> String {
        let shortest = format!("{self:?}");
        // The shortest decimal that rounds to the largest f32 is above it as a real number: not every compiler reads
        // it.
        let is_above = shortest.parse().is_ok_and(|real: f64| f64::from(f32::MAX) < real.abs());
        if is_above { format!("{self:.1}f") } else { format!("{shortest}f") }
    }
}

impl Literal for u32 {
    fn type_name() -> String {
        u32::wgsl()
    }
    fn literal(&self) -> String {
        format!("{self}u")
    }
}

impl Literal for i32 {
    fn type_name() -> String {
        "i32".to_owned()
    }
    fn literal(&self) -> String {
        format!("{self}i")
    }
}

impl Literal for usize {
    fn type_name() -> String {
        u32::wgsl()
    }
    fn literal(&self) -> String {
        format!("{self}u")
    }
}

impl<T: Literal, const N: usize> Literal for [T; N] {
    fn type_name() -> String {
        format!("array<{}, {N}>", T::type_name())
    }
    fn literal(&self) -> String {
        let values: Vec<String> = self.iter().map(Literal::literal).collect();
        format!("{}({})", Self::type_name(), values.join(", "))
    }
}

/// Prints the lines of a doc comment as a WGSL comment, indented by `depth`.
pub fn comment(depth: &str, lines: &[&str]) -> String {
    lines.iter().map(|line| format!("{depth}// {}", plain(line.trim())).trim_end().to_owned() + "\n").collect()
}

/// The lines of a doc comment as plain text on one line.
pub fn sentence(lines: &[&str]) -> String {
    lines.iter().map(|line| plain(line.trim())).collect::<Vec<String>>().join(" ").trim_end_matches('.').to_owned()
}

/// A line of a doc comment as plain text: a link is its text, a path from `crate` on is its last name, and a unit's
/// bracket, which is escaped for rustdoc, has no backslash.
fn plain(line: &str) -> String {
    let mut plain = String::new();
    let mut rest = line;
    while let Some((before, link)) = rest.split_once("[`") {
        plain += before;
        let Some((path, after)) = link.split_once("`]") else {
            plain += "[`";
            rest = link;
            continue;
        };
        let module = path.rfind("::").filter(|_| path.starts_with("crate::")).map_or(0, |end| end + 2);
        plain += &format!("`{}`", &path[module..]);
        rest = after.strip_prefix('(').and_then(|target| target.split_once(')')).map_or(after, |(_, after)| after);
    }
    (plain + rest).replace("\\[", "[")
}

/// One of a closed list of names: an unknown one cannot be written.
pub trait Named: Copy + Eq + std::fmt::Debug + 'static {
    /// Every one, in order.
    const ALL: &'static [Self];

    /// The name.
    fn name(self) -> &'static str;

    /// The item's index in [`Named::ALL`].
    fn index(self) -> usize;

    /// The one with this name.
    fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|known| known.name() == name)
    }
}

/// An enum that is a closed list of names, see [`Named`](crate::layout::shared::Named).
#[macro_export]
macro_rules! named {
    ($(#[$attribute:meta])* pub enum $list:ident { $($(#[$item_attribute:meta])* $item:ident = $name:literal,)* }) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum $list {
            $($(#[$item_attribute])* $item,)*
        }

        impl $list {
            /// Every one, in order.
            pub const ALL: [$list; [$($name),*].len()] = [$($list::$item),*];

            /// The name.
            pub const fn name(self) -> &'static str {
                match self {
                    $($list::$item => $name,)*
                }
            }

            /// The one with this name.
            pub fn named(name: &str) -> Option<$list> {
                <$list as $crate::layout::shared::Named>::named(name)
            }
        }

        impl $crate::layout::shared::Named for $list {
            const ALL: &'static [$list] = &$list::ALL;

            fn name(self) -> &'static str {
                $list::name(self)
            }

            fn index(self) -> usize {
                self as usize
            }
        }
    };
}

/// Structs of plain data, each with its twin in WGSL.
///
/// Beside them `structs` says where their fields lie, and `printed_structs` gives the twins.
#[macro_export]
macro_rules! shared {
    ($($(#[doc = $doc:literal])* pub struct $name:ident { $($(#[doc = $field_doc:literal])* pub $field:ident: $type:ty,)* })*) => {
        $(
            $(#[doc = $doc])*
            #[repr(C)]
            #[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
            pub struct $name {
                $($(#[doc = $field_doc])* pub $field: $type,)*
            }

            impl $crate::layout::shared::Shared for $name {
                fn wgsl() -> String {
                    stringify!($name).to_owned()
                }
            }
        )*

        /// Every shared struct.
        #[allow(dead_code, reason = "used by tests alone where no other code looks at a layout")]
        pub fn structs() -> Vec<$crate::layout::shared::Struct> {
            vec![$($crate::layout::shared::Struct {
                name: stringify!($name),
                size: size_of::<$name>(),
                fields: vec![$($crate::layout::shared::Field {
                    name: stringify!($field),
                    offset: std::mem::offset_of!($name, $field),
                    wgsl: <$type as $crate::layout::shared::Shared>::wgsl(),
                    doc: $crate::layout::shared::sentence(&[$($field_doc),*]),
                },)*],
            },)*]
        }

        /// The structs in WGSL.
        pub(crate) fn printed_structs() -> String {
            let mut printed = String::new();
            $(
                printed += &$crate::layout::shared::comment("", &[$($doc),*]);
                printed += &format!("struct {} {{\n", stringify!($name));
                $(
                    printed += &$crate::layout::shared::comment("    ", &[$($field_doc),*]);
                    printed += &format!("    {}: {},\n", stringify!($field), <$type as $crate::layout::shared::Shared>::wgsl());
                )*
                printed += "}\n\n";
            )*
            printed
        }
    };
}

/// Constants, each with its twin in WGSL.
macro_rules! constants {
    ($($(#[doc = $doc:literal])* $visibility:vis const $name:ident: $type:ty = $value:expr;)*) => {
        $($(#[doc = $doc])* $visibility const $name: $type = $value;)*

        /// The constants above in WGSL.
        pub(crate) fn printed_constants() -> String {
            use $crate::layout::shared::{Literal, comment};
            let mut printed = String::new();
            $(
                printed += &comment("", &[$($doc),*]);
                printed += &format!("const {}: {} = {};\n", stringify!($name), <$type>::type_name(), $name.literal());
            )*
            printed
        }
    };
}

pub(crate) use constants;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_literal_is_at_most_the_largest_f32_as_a_real_number_and_reads_back_to_the_last_bit() {
        let largest = f64::from(f32::MAX);
        for value in [f32::MAX, f32::MIN, f32::MAX.next_down(), f32::MIN_POSITIVE, 0.1, -1e38, 16_777_216.0, 0.0] {
            let literal = value.literal();
            let text = literal.strip_suffix('f').unwrap();
            assert!(text.parse::<f64>().unwrap().abs() <= largest, "{literal}");
            assert_eq!(text.parse::<f32>().unwrap().to_bits(), value.to_bits(), "{literal}");
        }
        // What is written of the largest one is exact, not rounded to an f64.
        assert_eq!(f32::MAX.literal(), "340282346638528859811704183484516925440.0f");
        assert_eq!(0.1f32.literal(), "0.1f");
    }

    #[test]
    fn a_printed_comment_is_plain_text_with_one_space_before_it() {
        let printed = |line: &str| comment("    ", &[line]);
        assert_eq!(printed(" Range \\[m]"), "    // Range [m]\n");
        assert_eq!(printed("  Rates, [n_envs]."), "    // Rates, [n_envs].\n");
        assert_eq!(printed(" Bits: [`BEGINS`], [`Row::what`]."), "    // Bits: `BEGINS`, `Row::what`.\n");
        assert_eq!(printed(" Codes of [`crate::layout::Ended`]."), "    // Codes of `Ended`.\n");
        assert_eq!(printed(" See [`Ended`](crate::layout::Ended) for it."), "    // See `Ended` for it.\n");
        assert_eq!(printed(""), "    //\n");
        assert_eq!(printed(" An open [`bracket"), "    // An open [`bracket\n");
    }
}
