//! What the computer at hand has: memory that a run may take, as far as the system tells.

use std::fs;

/// Bytes of memory that this process can still get: what is free or can be freed, within the limits of its control
/// groups and of its address space. `None` where the system does not tell (it does on Linux).
pub fn available_memory() -> Option<u64> {
    let read = |path: &str| fs::read_to_string(path).ok();
    let free = read("/proc/meminfo").and_then(|text| kilobytes(&text, "MemAvailable:"));
    let space = read("/proc/self/limits").and_then(|text| address_space(&text));
    let groups = read("/proc/self/cgroup").and_then(|text| control_groups(&text, &read));
    [free, space, groups].into_iter().flatten().min()
}

/// The number behind a name, in bytes.
fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// The soft limit of the address space, which holds a little more than the memory in use.
fn address_space(limits: &str) -> Option<u64> {
    limits.lines().find_map(|line| line.strip_prefix("Max address space"))?.split_whitespace().next()?.parse().ok()
}

/// The least that is left in the groups of the process and in those around them; of both versions.
fn control_groups(groups: &str, read: &dyn Fn(&str) -> Option<String>) -> Option<u64> {
    let number = |path: String| read(&path)?.trim().parse::<u64>().ok();
    let mut least = None::<u64>;
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { continue };
        let (root, limit, usage, cache) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current", "inactive_file "),
            _ if controllers.split(',').any(|name| name == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file ")
            }
            _ => continue,
        };
        let mut path = path.trim_end_matches('/');
        loop {
            if let Some(limit) = number(format!("{root}{path}/{limit}")) {
                let used = number(format!("{root}{path}/{usage}")).unwrap_or(0);
                let statistics = read(&format!("{root}{path}/memory.stat")).unwrap_or_default();
                // The cache of files is given back when memory is asked for.
                let cached = statistics.lines().find_map(|line| line.strip_prefix(cache)?.trim().parse::<u64>().ok());
                let left = limit.saturating_sub(used.saturating_sub(cached.unwrap_or(0)));
                least = Some(least.map_or(left, |least| least.min(left)));
            }
            match path.rfind('/') {
                Some(end) => path = &path[..end],
                None => break,
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_in_what_the_system_tells() {
        let text = "MemTotal:       24683520 kB\nMemFree:         1000 kB\nMemAvailable:   2048 kB\n";
        assert_eq!(kilobytes(text, "MemAvailable:"), Some(2 << 20));
        assert_eq!(kilobytes("", "MemAvailable:"), None);
        let limits = "Limit                     Soft Limit           Hard Limit           Units     \n\
                      Max address space         2048000000           unlimited            bytes     \n";
        assert_eq!(address_space(limits), Some(2_048_000_000));
        assert_eq!(address_space(&limits.replace("2048000000", "unlimited ")), None);
        if cfg!(target_os = "linux") {
            assert!(available_memory().is_some_and(|bytes| bytes > 1 << 20));
        }
    }

    #[test]
    fn the_tightest_group_counts_and_its_cache_does_not() {
        let files = |path: &str| {
            let content = match path {
                "/sys/fs/cgroup/a/b/memory.max" => "max",
                "/sys/fs/cgroup/a/memory.max" => "1000\n",
                "/sys/fs/cgroup/a/memory.current" => "700",
                "/sys/fs/cgroup/a/memory.stat" => "active_file 5\ninactive_file 200\n",
                "/sys/fs/cgroup/memory.max" => "9000",
                "/sys/fs/cgroup/memory/memory.limit_in_bytes" => "400",
                _ => return None,
            };
            Some(content.to_owned())
        };
        assert_eq!(control_groups("0::/a/b\n", &files), Some(500));
        assert_eq!(control_groups("4:cpu,memory:/docker/1\n0::/elsewhere\n", &files), Some(400));
        assert_eq!(control_groups("0::/\n", &files), Some(9000));
        assert_eq!(control_groups("garbage", &files), None);
    }
}
