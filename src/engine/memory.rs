//! The host's free memory, against which a batch is checked before it is made.
//!
//! Linux grants memory that it does not have and ends the process that uses it, so a refused allocation is not enough.

use std::fs;

/// Memory of the host that can be used without ending another's work, where the system says so (bytes).
pub fn available() -> Option<u64> {
    let free = fs::read_to_string("/proc/meminfo").ok().and_then(|text| mem_available(&text));
    [free, container(), address_space()].into_iter().flatten().min()
}

/// What a container leaves of the memory that it is granted, which may be less than the machine has (bytes).
fn container() -> Option<u64> {
    let read = |file: &str| fs::read_to_string(format!("/sys/fs/cgroup/memory.{file}")).ok();
    let number = |file: &str| read(file)?.trim().parse::<u64>().ok();
    let reclaimable = read("stat").and_then(|text| inactive_file(&text)).unwrap_or(0);
    Some(number("max")?.saturating_sub(number("current").unwrap_or(0).saturating_sub(reclaimable)))
}

/// What a container caches of files and gives back when asked, of its `memory.stat` (bytes).
fn inactive_file(text: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix("inactive_file "))?.trim().parse().ok()
}

/// What a limit of the process's address space leaves, as `ulimit -v` sets one (bytes).
fn address_space() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let taken = fs::read_to_string("/proc/self/status").ok().and_then(|text| kilobytes(&text, "VmSize:"))?;
    Some(address_limit(&limits)?.saturating_sub(taken))
}

/// The soft limit of the address space in `/proc/self/limits`; none where there is no limit (bytes).
fn address_limit(text: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix("Max address space"))?.split_whitespace().next()?.parse().ok()
}

/// `MemAvailable` of `/proc/meminfo` (bytes).
fn mem_available(text: &str) -> Option<u64> {
    kilobytes(text, "MemAvailable:")
}

/// A value in kB of a file in `/proc` (bytes).
fn kilobytes(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::{address_limit, inactive_file, mem_available};

    #[test]
    fn available_memory_is_read_in_bytes() {
        assert_eq!(mem_available("MemTotal:  2048 kB\nMemFree: 1 kB\nMemAvailable:     1024 kB\n"), Some(1 << 20));
        assert_eq!(mem_available("MemTotal: 2048 kB\n"), None);
        assert_eq!(mem_available("MemAvailable: much\n"), None);
    }

    #[test]
    fn what_a_container_caches_of_files_is_read_in_bytes() {
        assert_eq!(inactive_file("anon 7\ninactive_file 4096\nactive_file 3\n"), Some(4096));
        assert_eq!(inactive_file("anon 7\n"), None);
    }

    #[test]
    fn a_limit_of_the_address_space_is_read_in_bytes() {
        let limits = |soft: &str| {
            format!("Max locked memory  8388608  8388608  bytes\nMax address space         {soft}  unlimited  bytes\n")
        };
        assert_eq!(address_limit(&limits("4096000000")), Some(4_096_000_000));
        assert_eq!(address_limit(&limits("unlimited")), None);
    }
}
