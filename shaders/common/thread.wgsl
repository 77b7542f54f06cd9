// Which thread works on what.

// This thread's place among all of a dispatch, whose workgroups lie in rows because one row would not hold them all.
fn thread_of(group: vec3<u32>, groups: vec3<u32>, local: u32) -> u32 {
    return (group.y * groups.x + group.x) * WORKGROUP + local;
}
