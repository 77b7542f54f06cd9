//! The shaders of a step, a file each, which make one module.

/// The shaders of a step as one module.
pub fn module() -> String {
    SHADERS.iter().flat_map(|(_, text)| [text, "\n"]).collect()
}

/// The shader files in the order in which they make one module.
pub const SHADERS: [(&str, &str); 28] = [
    ("layout", include_str!("../../../shaders/layout.wgsl")),
    ("common/thread", include_str!("../../../shaders/common/thread.wgsl")),
    ("common/angle", include_str!("../../../shaders/common/angle.wgsl")),
    ("common/random", include_str!("../../../shaders/common/random.wgsl")),
    ("common/road", include_str!("../../../shaders/common/road.wgsl")),
    ("common/field", include_str!("../../../shaders/common/field.wgsl")),
    ("common/truck", include_str!("../../../shaders/common/truck.wgsl")),
    ("draw", include_str!("../../../shaders/draw.wgsl")),
    ("steer", include_str!("../../../shaders/steer.wgsl")),
    ("drive", include_str!("../../../shaders/drive.wgsl")),
    ("traffic/cars", include_str!("../../../shaders/traffic/cars.wgsl")),
    ("traffic/large", include_str!("../../../shaders/traffic/large.wgsl")),
    ("traffic/driver", include_str!("../../../shaders/traffic/driver.wgsl")),
    ("traffic/truck", include_str!("../../../shaders/traffic/truck.wgsl")),
    ("traffic/contact", include_str!("../../../shaders/traffic/contact.wgsl")),
    ("traffic", include_str!("../../../shaders/traffic.wgsl")),
    ("collide", include_str!("../../../shaders/collide.wgsl")),
    ("follow", include_str!("../../../shaders/follow.wgsl")),
    ("perceive", include_str!("../../../shaders/perceive.wgsl")),
    ("sense", include_str!("../../../shaders/sense.wgsl")),
    ("observe", include_str!("../../../shaders/observe.wgsl")),
    ("around", include_str!("../../../shaders/around.wgsl")),
    ("judge", include_str!("../../../shaders/judge.wgsl")),
    ("count", include_str!("../../../shaders/count.wgsl")),
    ("copy_observation", include_str!("../../../shaders/copy_observation.wgsl")),
    ("along", include_str!("../../../shaders/along.wgsl")),
    ("reset", include_str!("../../../shaders/reset.wgsl")),
    ("advance", include_str!("../../../shaders/advance.wgsl")),
];
