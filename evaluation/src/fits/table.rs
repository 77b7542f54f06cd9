//! The answers as a table of text that fits a terminal, and as CSV.

use std::collections::HashMap;
use std::fmt::Write;

use offtrack::files::reader::{shortened, shown};

use super::row::Row;
use super::way::Way;
use crate::tabular::quoted;

/// Metres in a foot.
pub const FOOT: f64 = 0.3048;
/// Kilometres in a mile.
const MILE: f64 = 1.609_344;
/// Width of a name that is long, at least (columns).
const LEAST_NAME: usize = 8;

/// The units of the table and of sheets. Other files have metres and km/h, whatever these have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Units {
    /// Metres and km/h.
    Metric,
    /// Feet and mph.
    Feet,
}

impl Units {
    /// A length with its digits; a zero has no sign (m).
    pub fn length(self, metres: f64) -> String {
        let rounded = |value: f64, parts: f64| (value * parts).round() / parts + 0.0;
        match self {
            Units::Metric => format!("{:.2}", rounded(metres, 100.0)),
            Units::Feet => format!("{:.1}", rounded(metres / FOOT, 10.0)),
        }
    }

    /// A way's clearance with its digits: of one that does not fit rounded down where it would seem to (m).
    pub fn clearance(self, way: &Way) -> String {
        let nearest = self.length(way.clearance());
        if way.fits || nearest.starts_with('-') {
            return nearest;
        }
        let (unit, parts) = if self == Units::Metric { (1.0, 100.0) } else { (FOOT, 10.0) };
        // Clearances have four digits: what is less is the rounding of a product.
        self.length((way.clearance() / unit * parts + 1e-3).floor() / parts * unit)
    }

    /// The unit of lengths.
    pub fn of_length(self) -> &'static str {
        match self {
            Units::Metric => "m",
            Units::Feet => "ft",
        }
    }

    pub(super) fn speed(self, kmh: f64) -> String {
        match self {
            Units::Metric => format!("{kmh:.0}"),
            Units::Feet => format!("{:.0}", kmh / MILE),
        }
    }

    /// A speed as it was asked for, to a tenth of a mile an hour (km/h).
    pub fn exact_speed(self, kmh: f64) -> String {
        match self {
            Units::Metric => shown(kmh),
            Units::Feet => shown((kmh / MILE * 10.0).round() / 10.0),
        }
    }

    /// The unit of speeds.
    pub fn of_speed(self) -> &'static str {
        match self {
            Units::Metric => "km/h",
            Units::Feet => "mph",
        }
    }
}

/// A column: its heading in two lines, and its cell of a row.
type Column = ([String; 2], Box<dyn Fn(&Row) -> String>);

/// The columns after the names, the most important first; one of aprons where a road has any.
fn columns(rows: &[Row], units: Units) -> Vec<Column> {
    let unit = units.of_length();
    let length = move |value: f64| units.length(value);
    let of_way = move |way: Option<&Way>| way.map_or("-".to_owned(), |way| units.clearance(way));
    let heading = |first: &str, second: &str| [first.to_owned(), second.to_owned()];
    let mut columns: Vec<Column> = vec![
        (heading("fits by", ""), Box::new(|row| row.verdict().to_owned())),
        (heading("clearance", &format!("centre {unit}")), Box::new(move |row| of_way(Some(&row.lane_centre)))),
        (heading("clearance", &format!("way {unit}")), Box::new(move |row| of_way(row.way.as_ref()))),
        (heading("swept", unit), Box::new(move |row| length(row.shown().swept_width))),
        (heading("off-track", unit), Box::new(move |row| length(row.shown().off_tracking))),
        (heading("steer", "deg"), Box::new(|row| format!("{:.0}", row.shown().steer_angle_deg))),
        (heading("fastest", units.of_speed()), Box::new(move |row| units.speed(row.fastest_kmh))),
        (
            heading("radius", unit),
            Box::new(move |row| row.shown().lowest_radius.map_or("-".to_owned(), |radius| units.length(radius))),
        ),
        (
            heading("lateral", "g"),
            Box::new(|row| format!("{:.2}", row.shown().lateral_acceleration / offtrack::vehicle::GRAVITY)),
        ),
        (heading("load", "transfer"), Box::new(|row| format!("{:.2}", row.shown().load_transfer_ratio))),
    ];
    if rows.iter().any(|row| row.shown().apron_clearance.is_some()) {
        let on_apron = move |row: &Row| match row.shown().apron_use() {
            Some(0.0) => "no".to_owned(),
            Some(by) => length(by),
            None => "-".to_owned(),
        };
        columns.insert(3, (heading("on apron", unit), Box::new(on_apron)));
    }
    columns
}

/// A line for each row under two lines of headings, none longer than `width`: what there is no room for is left out
/// from the right, and a last line says so.
pub fn table(rows: &[Row], width: usize, units: Units) -> String {
    let columns = columns(rows, units);
    let cells: Vec<Vec<String>> = columns.iter().map(|(_, cell)| rows.iter().map(cell).collect()).collect();
    let widths: Vec<usize> = columns
        .iter()
        .zip(&cells)
        .map(|((heading, _), cells)| heading.iter().chain(cells).map(|text| text.chars().count()).max().unwrap_or(0))
        .collect();
    let longest = |name: &dyn Fn(&Row) -> &str, heading: &str| {
        rows.iter().map(|row| name(row).chars().count()).chain([heading.len()]).max().unwrap_or(0)
    };
    let (route, vehicle) = (longest(&|row| &row.route, "route"), longest(&|row| &row.vehicle, "vehicle"));
    // The verdict is always shown: long names give way to it.
    let for_names = width.saturating_sub(widths[0] + 4).max(2 * LEAST_NAME);
    let vehicle = vehicle.min((for_names / 2).max(for_names.saturating_sub(route)));
    let route = route.min(for_names - vehicle);
    let (mut used, mut shown) = (route + 2 + vehicle, 0);
    while shown < columns.len() && (shown == 0 || used + 2 + widths[shown] <= width) {
        used += 2 + widths[shown];
        shown += 1;
    }
    let line = |route_cell: &str, vehicle_cell: &str, cell: &dyn Fn(usize) -> String| {
        let mut line = format!("{route_cell:<route$}  {vehicle_cell:<vehicle$}");
        for (index, &width) in widths.iter().enumerate().take(shown) {
            let text = cell(index);
            // Words stand on the left, numbers on the right.
            let _ = if index == 0 { write!(line, "  {text:<width$}") } else { write!(line, "  {text:>width$}") };
        }
        line.trim_end().to_owned() + "\n"
    };
    let mut text = line("route", "vehicle", &|index| columns[index].0[0].clone());
    text += &line("", "", &|index| columns[index].0[1].clone());
    for (number, row) in rows.iter().enumerate() {
        let names = (shortened(&row.route, route), shortened(&row.vehicle, vehicle));
        text += &line(&names.0, &names.1, &|index| cells[index][number].clone());
    }
    if shown < columns.len() {
        text += "more columns in fits.csv\n";
    }
    text
}

/// The verdicts as CSV: a row for each route, a column for each vehicle, in the cells by what it fits, or which limit
/// of the truck refuses it, and the clearance of the path shown (m).
pub fn verdicts(rows: &[Row]) -> String {
    let mut vehicles: Vec<&str> = Vec::new();
    let mut routes: Vec<(&str, HashMap<&str, String>)> = Vec::new();
    for row in rows {
        if !vehicles.contains(&row.vehicle.as_str()) {
            vehicles.push(&row.vehicle);
        }
        let limit = row.limit().map_or_else(String::new, |limit| format!(": {}", limit.name()));
        let cell = format!("{}{limit} {}", row.verdict(), Units::Metric.clearance(row.shown()));
        match routes.iter_mut().find(|(route, _)| *route == row.route) {
            Some((_, cells)) => drop(cells.insert(&row.vehicle, cell)),
            None => routes.push((&row.route, HashMap::from([(row.vehicle.as_str(), cell)]))),
        }
    }
    let line = |first: &str, cells: &mut dyn Iterator<Item = String>| {
        let cells: Vec<String> = std::iter::once(quoted(first)).chain(cells).collect();
        cells.join(",") + "\n"
    };
    let heading = line("route", &mut vehicles.iter().map(|vehicle| quoted(vehicle)));
    let of = |(route, cells): &(&str, HashMap<&str, String>)| {
        line(route, &mut vehicles.iter().map(|vehicle| cells.get(vehicle).cloned().unwrap_or_default()))
    };
    heading + &routes.iter().map(of).collect::<String>()
}

/// The columns of a path's figures in CSV, and its cells.
const WAY: [&str; 15] = [
    "fits",
    "tractor_clearance",
    "tractor_x",
    "tractor_y",
    "trailer_clearance",
    "trailer_x",
    "trailer_y",
    "swept_width",
    "off_tracking",
    "leaves_lane_left",
    "leaves_lane_right",
    "lowest_radius",
    "steer_angle_deg",
    "steer_rate_deg",
    "lateral_acceleration",
];

fn way_cells(way: &Way) -> Vec<String> {
    let numbers = [
        way.tractor.clearance,
        way.tractor.x,
        way.tractor.y,
        way.trailer.clearance,
        way.trailer.x,
        way.trailer.y,
        way.swept_width,
        way.off_tracking,
        way.leaves_lane_left,
        way.leaves_lane_right,
    ];
    let after = [way.steer_angle_deg, way.steer_rate_deg, way.lateral_acceleration, way.load_transfer_ratio];
    let radius = way.lowest_radius.map(|radius| radius.to_string()).unwrap_or_default();
    let cells = numbers.iter().map(f64::to_string).chain([radius]).chain(after.iter().map(f64::to_string));
    let apron = way.apron_clearance.map(|clearance| clearance.to_string()).unwrap_or_default();
    let refused_by = way.refused_by.map(|refusal| refusal.name().to_owned()).unwrap_or_default();
    std::iter::once(way.fits.to_string()).chain(cells).chain([apron, refused_by]).collect()
}

/// The answers as CSV, a row each under one of names, in metres and as `fits.json` names them; columns of the lane's
/// centre line begin with `lane_centre_`, those of the way found with `way_`.
pub fn csv(rows: &[Row]) -> String {
    let way_names = || WAY.iter().copied().chain(["load_transfer_ratio", "apron_clearance", "refused_by"]);
    let mut heading: Vec<String> = ["route", "vehicle", "fits", "fastest_kmh"].map(str::to_owned).to_vec();
    for prefix in ["lane_centre_", "way_"] {
        heading.extend(way_names().map(|name| format!("{prefix}{name}")));
    }
    let mut text = heading.join(",") + "\n";
    for row in rows {
        let mut cells =
            vec![quoted(&row.route), quoted(&row.vehicle), row.fits.to_string(), row.fastest_kmh.to_string()];
        cells.extend(way_cells(&row.lane_centre));
        cells.extend(row.way.as_ref().map_or_else(|| way_names().map(|_| String::new()).collect(), way_cells));
        text += &(cells.join(",") + "\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::way::{Nearest, Refusal};
    use super::*;
    use crate::certificate::file::Found;

    fn row(route: &str, vehicle: &str) -> Row {
        let near = Nearest { clearance: -0.25, x: 1.0, y: 2.0 };
        let way = Way {
            fits: false,
            refused_by: Some(Refusal::Kerb),
            tractor: Nearest { clearance: 0.5, ..near },
            trailer: near,
            swept_width: 5.5,
            swept_width_at: [0.0, 0.0],
            off_tracking: 3.048,
            leaves_lane_left: 0.1,
            leaves_lane_right: 0.2,
            lowest_radius: None,
            steer_angle_deg: 30.0,
            steer_rate_deg: 10.0,
            lateral_acceleration: 0.981,
            load_transfer_ratio: 0.2,
            apron_clearance: None,
        };
        let search = Found {
            ended: "collided".into(),
            progress: 0.5,
            steps: 1,
            width: 64,
            hold: 3,
            env_steps: 1,
            actions: String::new(),
        };
        Row {
            route: route.into(),
            vehicle: vehicle.into(),
            fits: false,
            lane_centre: way,
            way: None,
            fastest_kmh: 32.18688,
            search,
            searched_clearance: 0.0,
        }
    }

    #[test]
    fn no_line_of_a_table_is_longer_than_the_terminal_and_the_verdict_is_always_there() {
        let long = "a".repeat(60);
        let rows = [row("16m/N-left-3", "us_wb62"), row(&format!("{long}/N-left-3"), &long)];
        for width in 40..140 {
            let text = table(&rows, width, Units::Metric);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{width}:\n{text}");
            assert_eq!(text.matches("does not fit").count(), 2, "{width}:\n{text}");
            assert_eq!(text.contains("more columns"), !text.contains("transfer"), "{width}:\n{text}");
        }
        let wide = table(&rows[..1], 120, Units::Metric);
        assert!(wide.contains("-0.25") && wide.contains("3.05") && wide.contains("0.10"), "{wide}");
        assert_eq!(["0.00", "-0.01"], [-0.0004, -0.006].map(|metres| Units::Metric.length(metres)));
        let feet = table(&rows[..1], 120, Units::Feet);
        assert!(feet.contains("10.0") && feet.contains(" ft") && feet.contains("20") && feet.contains("mph"), "{feet}");
    }

    #[test]
    fn a_table_says_by_how_much_an_apron_is_used_and_only_where_a_road_has_one() {
        let with = |clearance: Option<f64>| {
            let mut row = row("16m/N-left-3", "us_wb62");
            row.lane_centre.apron_clearance = clearance;
            row
        };
        let cells = |rows: &[Row]| -> Vec<String> {
            let text = table(rows, 200, Units::Metric);
            let at = text.find("on apron");
            at.map_or_else(Vec::new, |at| text.lines().skip(2).map(|line| line[at..at + 8].trim().to_owned()).collect())
        };
        assert_eq!(cells(&[with(Some(-0.853)), with(Some(0.2)), with(None)]), ["0.85", "no", "-"]);
        assert_eq!(cells(&[with(None)]), Vec::<String>::new());
        let text = csv(&[with(Some(-0.853))]);
        assert!(text.lines().nth(1).unwrap().contains(",0.2,-0.853,"), "{text}");
    }

    #[test]
    fn verdicts_are_a_row_a_route_and_a_column_a_vehicle_with_a_gap_where_none_was_asked_for() {
        let mut fits = row("16m/N-left-3", "us_wb62");
        (fits.fits, fits.lane_centre.fits, fits.lane_centre.trailer.clearance) = (true, true, 0.456);
        let rows = [row("16m/N-left-3", "daf_xf"), fits, row("16m/S-left-3", "us_wb62")];
        let expected = "route,daf_xf,us_wb62\n16m/N-left-3,does not fit -0.25,lane centre 0.46\n\
                        16m/S-left-3,,does not fit -0.25\n";
        assert_eq!(verdicts(&rows), expected);
    }

    #[test]
    fn a_verdict_names_the_limit_that_refuses_and_its_clearance_never_seems_to_do() {
        let of = |clearance: f64, refusal: Refusal| {
            let mut row = row("16m/N-left-3", "us_wb62");
            let near = Nearest { clearance, x: 0.0, y: 0.0 };
            (row.lane_centre.tractor, row.lane_centre.trailer) = (near, near);
            row.lane_centre.refused_by = Some(refusal);
            let text = verdicts(std::slice::from_ref(&row));
            (text.lines().nth(1).unwrap().split_once(',').unwrap().1.to_owned(), csv(&[row]))
        };
        assert_eq!(of(-0.0022, Refusal::Kerb).0, "does not fit -0.01");
        assert_eq!(of(0.4962, Refusal::Kerb).0, "does not fit 0.49");
        assert_eq!(of(-0.4931, Refusal::Kerb).0, "does not fit -0.49");
        assert_eq!(of(0.29, Refusal::Kerb).0, "does not fit 0.29");
        let (verdict, csv) = of(3.21, Refusal::Lock);
        assert!(verdict == "does not fit: lock 3.21" && csv.contains(",lock,"), "{verdict} {csv}");
    }

    #[test]
    fn every_row_of_csv_has_a_cell_for_each_name_and_names_with_commas_are_quoted() {
        let mut with_way = row("a", "b");
        with_way.way = Some(with_way.lane_centre.clone());
        let text = csv(&[row("a", "b"), with_way]);
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(lines.iter().map(Vec::len).collect::<Vec<_>>(), [40; 3]);
        let of = |name: &str, line: usize| lines[line][lines[0].iter().position(|other| *other == name).unwrap()];
        assert_eq!((of("lane_centre_trailer_clearance", 1), of("way_trailer_clearance", 1)), ("-0.25", ""));
        assert_eq!((of("way_lowest_radius", 2), of("way_load_transfer_ratio", 2)), ("", "0.2"));
        assert_eq!(quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
    }
}
