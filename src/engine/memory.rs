//! The host's free memory, against which a batch is checked before it is made.
//!
//! Linux grants memory that it does not have and ends the process that uses it, so a refused allocation is not enough.

use std::fs;

/// Memory that can be used without ending another's work, where the system says so [bytes].
pub(super) fn available() -> Option<u64> {
    let free = fs::read_to_string("/proc/meminfo").ok().and_then(|text| mem_available(&text));
    // A container may be granted less than the machine has.
    let granted = fs::read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|text| text.trim().parse().ok());
    [free, granted].into_iter().flatten().min()
}

/// `MemAvailable` of `/proc/meminfo` [bytes].
fn mem_available(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::mem_available;

    #[test]
    fn available_memory_is_read_in_bytes() {
        assert_eq!(mem_available("MemTotal:  2048 kB\nMemFree: 1 kB\nMemAvailable:     1024 kB\n"), Some(1 << 20));
        assert_eq!(mem_available("MemTotal: 2048 kB\n"), None);
        assert_eq!(mem_available("MemAvailable: much\n"), None);
    }
}
