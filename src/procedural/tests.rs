//! Which roads are drawn.

use super::*;

#[test]
fn report() {
    let distribution = Distribution::named("wide").unwrap();
    let started = std::time::Instant::now();
    let indices: Vec<u32> = (0..400).collect();
    let roads = distribution.roads(1, &indices, &crate::loading::Loading::PLAIN).unwrap();
    println!("{:?}", started.elapsed());
    let mut all = Refused::default();
    roads.iter().for_each(|road| all.add(&road.refused));
    let draws = all.total() as usize + roads.len();
    println!("{} draws, {:.1} % valid", draws, 100.0 * roads.len() as f64 / draws as f64);
    for reason in Reason::ALL {
        println!("{:6.1} % {}", 100.0 * f64::from(all.count(reason)) / draws as f64, reason.words());
    }
    let mut islands = [0; 6];
    for road in &roads {
        let r = road.roundabout.island_radius();
        islands[[9.0, 10.0, 12.0, 16.0, 22.0, 30.0].iter().position(|&x| r < x).unwrap()] += 1;
    }
    println!("{islands:?}");
    println!("{}", roads[0].text());
}
