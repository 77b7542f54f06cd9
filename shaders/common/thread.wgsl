// Which thread works on what.

// The arguments of every kernel.
struct Thread {
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    // Index in the workgroup.
    @builtin(local_invocation_index) local: u32,
}

// Index of a thread among all of a dispatch. Workgroups lie in rows, since one row would not hold them all.
fn index_of(thread: Thread) -> u32 {
    return (thread.group.y * thread.groups.x + thread.group.x) * WORKGROUP + thread.local;
}
