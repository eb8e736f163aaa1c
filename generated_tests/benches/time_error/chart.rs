//! The pictures: light ground, axes with units, names beside what they name.

use crate::function::{Group, Method, Panel};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::fmt::Write;
use std::path::Path;
use straightline_codegen::Function;

const TITLE: i32 = 22;
const WORDS: i32 = 15;
const SMALL: i32 = 12;
pub const INK: RGBColor = RGBColor(40, 44, 52);
const PALE: RGBColor = RGBColor(225, 228, 232);

/// Colours that differ for colour-blind eyes too (Okabe and Ito).
pub const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(120, 120, 120),
    RGBColor(230, 159, 0),
];

fn colour(group: Group) -> RGBColor {
    COLOURS[Group::ALL.iter().position(|g| *g == group).expect("it is one of them")]
}

/// 10^k as people write it.
pub fn power(x: &f64) -> String {
    // no −0
    let exponent = x.log10().round() + 0.0;
    if (x.log10() - exponent).abs() > 1e-6 {
        return String::new();
    }
    let digits: String = format!("{exponent}")
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            _ => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c.to_digit(10).unwrap_or(0) as usize],
        })
        .collect();
    format!("10{digits}")
}

/// A time in its unit.
pub fn time(ns: &f64) -> String {
    match *ns {
        x if x >= 0.99e9 => format!("{:.0} s", x / 1e9),
        x if x >= 0.99e6 => format!("{:.0} ms", x / 1e6),
        x if x >= 0.99e3 => format!("{:.0} µs", x / 1e3),
        x => format!("{x:.0} ns"),
    }
}

/// Names at the heights of their points, moved apart where they would meet: each heap of them about its middle.
fn spread(mut places: Vec<(usize, i32)>, gap: i32, low: i32, high: i32) -> Vec<(usize, i32)> {
    // stable: those at one height keep their order
    places.sort_by_key(|p| p.1);
    // heaps: how many, and where the middle of the first name is wanted to be
    let mut heaps: Vec<(usize, f64)> = Vec::new();
    let reach = |(n, top): (usize, f64)| top + f64::from(gap) * n as f64;
    for place in &places {
        heaps.push((1, f64::from(place.1.clamp(low, high))));
        while let [.., (m, above), (n, below)] = heaps[..] {
            if reach((m, above)) <= below {
                break;
            }
            heaps.truncate(heaps.len() - 2);
            let (all, shifted) = (m + n, below - f64::from(gap) * m as f64);
            let top = (above * m as f64 + shifted * n as f64) / all as f64;
            let highest = f64::from(high) - f64::from(gap) * (all - 1) as f64;
            heaps.push((all, top.min(highest).max(f64::from(low))));
        }
    }
    let tops = heaps.into_iter().flat_map(|(n, top)| (0..n).map(move |k| top as i32 + gap * k as i32));
    places.iter().zip(tops).map(|(p, y)| (p.0, y)).collect()
}

/// What belongs together: `gravity alone, 10 % speed` is one of `gravity alone`; its own mark is `10 %`.
fn family(m: &Method) -> Option<(&str, String)> {
    let (name, mark) = m.name.split_once(", ").or_else(|| m.name.split_once(" for "))?;
    (m.group == Group::Reduced).then(|| (name, mark.replace(" speed", "")))
}

/// Errors below this are drawn at it, with a mark: the axis ends where no plain format reaches.
const LEAST: f64 = 3e-18;

pub fn function(panel: &Panel, path: &Path) {
    let methods = &panel.methods;
    let (width, height) = (1180, 760);
    let area = SVGBackend::new(path, (width, height)).into_drawing_area();
    area.fill(&WHITE).expect("the picture can be written");
    let fastest = methods.iter().map(|m| m.time[0]).fold(f64::MAX, f64::min) / 1.6;
    let slowest = methods.iter().map(|m| m.time[2].max(m.time[0])).fold(0.0, f64::max) * 1.4;
    let bottom = LEAST;
    let (plot, _) = area.split_horizontally(width as i32 - 330);
    let title = format!(
        "{}, {}: every way to compute it, time against error (further down and left is better)",
        panel.robot,
        panel.function.name().replace('_', " ")
    );
    area.draw(&Text::new(title, (24, 16), ("sans-serif", TITLE).into_font().color(&INK))).expect("text");
    let mut chart = ChartBuilder::on(&plot)
        .margin_top(56)
        .margin_bottom(14)
        .margin_left(14)
        .x_label_area_size(52)
        .y_label_area_size(74)
        .build_cartesian_2d((fastest..slowest).log_scale(), (bottom..10.0).log_scale())
        .expect("ranges");
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(PALE)
        .axis_style(INK)
        .x_desc("time per evaluation")
        .y_desc("error over the greatest output in the joints' limits")
        .axis_desc_style(("sans-serif", WORDS).into_font().color(&INK))
        .label_style(("sans-serif", SMALL).into_font().color(&INK))
        .x_label_formatter(&time)
        .y_label_formatter(&power)
        .y_labels(12)
        .draw()
        .expect("axes");
    // what a user compares with
    let sensor = (panel.function == Function::InverseDynamics).then_some((1e-4, "a good torque sensor"));
    let roundings = [(f64::EPSILON / 2.0, "unit roundoff of f64"), (6e-8, "unit roundoff of f32")];
    for (level, words) in roundings.into_iter().chain(sensor) {
        let line = [(fastest, level), (slowest, level)];
        chart.draw_series(DashedLineSeries::new(line, 4, 4, INK.mix(0.45).stroke_width(1))).expect("line");
        let at = chart.backend_coord(&(slowest, level));
        let style = ("sans-serif", SMALL).into_font().color(&INK.mix(0.6));
        let style = style.pos(Pos::new(HPos::Right, VPos::Bottom));
        plot.draw(&Text::new(words, (at.0 - 4, at.1 - 1), style)).expect("text");
    }
    for m in methods {
        let ink = colour(m.group);
        let warm = m.time[0];
        let (rms, worst) = (m.rms.max(bottom), m.worst.max(1.5 * bottom));
        if m.time[2] > warm * 1.05 {
            let line = vec![(warm, worst), (m.time[2], worst)];
            chart.draw_series([PathElement::new(line, ink.mix(0.4).stroke_width(1))]).expect("line");
        }
        let top = m.cap.unwrap_or(worst);
        chart.draw_series([PathElement::new(vec![(warm, rms), (warm, top)], ink.stroke_width(2))]).expect("line");
        chart.draw_series([Circle::new((warm, worst), 5, ink.filled())]).expect("dot");
        if m.rms > bottom {
            chart.draw_series([Circle::new((warm, rms), 3, ink.stroke_width(2))]).expect("dot");
        }
        if let Some(cap) = m.cap {
            chart.draw_series([TriangleMarker::new((warm, cap), 7, ink.filled())]).expect("cap");
        }
        if let Some((_, mark)) = family(m) {
            let (x, y) = chart.backend_coord(&(warm, worst));
            // times at the right of their dots, speeds at the left: two families stand close
            let (x, side) = if mark.ends_with("ms") { (x + 8, HPos::Left) } else { (x - 8, HPos::Right) };
            let style = ("sans-serif", SMALL).into_font().color(&ink).pos(Pos::new(side, VPos::Bottom));
            plot.draw(&Text::new(mark, (x, y + 2), style)).expect("text");
        }
    }
    // names in a column at the right, in the order of the errors, tied to their points; a family has one, at its greatest error
    let mut order: Vec<usize> = Vec::new();
    for (i, m) in methods.iter().enumerate() {
        let same = |k: &usize| family(m).is_some_and(|(name, _)| family(&methods[*k]).is_some_and(|f| f.0 == name));
        if !order.iter().any(same) {
            order.push(i);
        }
    }
    // of those at one height the rightmost first, so that their lines do not cross
    order.sort_by(|a, b| methods[*b].time[0].total_cmp(&methods[*a].time[0]));
    let point = |i: usize| chart.backend_coord(&(methods[i].time[0], methods[i].worst.max(1.5 * bottom)));
    let points: Vec<(usize, i32)> = order.into_iter().map(|i| (i, point(i).1)).collect();
    let left = width as i32 - 330;
    for (i, y) in spread(points, 17, 66, height as i32 - 76) {
        let m = &methods[i];
        let (x0, y0) = point(i);
        let ink = colour(m.group);
        let end = left + 4;
        area.draw(&PathElement::new(vec![(x0 + 7, y0), (end - 14, y), (end, y)], ink.mix(0.25).stroke_width(1)))
            .expect("line");
        let style = ("sans-serif", SMALL + 1).into_font().color(&ink);
        let text = match family(m) {
            Some((name, _)) => format!("{name} · {}", time(&m.time[0])),
            None => format!("{} · {} · {:.0e}", m.name, time(&m.time[0]), m.worst),
        };
        area.draw(&Text::new(text, (end + 4, y - 8), style)).expect("text");
    }
    // between what f32 and what f64 lose nothing lies
    let (at, top) = chart.backend_coord(&(fastest * 1.2, 6e-9));
    legend(&plot, (at, top), &shown(methods));
    area.present().expect("the picture can be written");
    println!("{}", path.display());
}

fn shown(methods: &[Method]) -> Vec<(String, RGBColor)> {
    let groups = Group::ALL.into_iter().filter(|g| methods.iter().any(|m| m.group == *g));
    groups.map(|g| (g.name().to_string(), colour(g))).collect()
}

fn legend<DB: DrawingBackend>(
    area: &DrawingArea<DB, plotters::coord::Shift>,
    (left, top): (i32, i32),
    entries: &[(String, RGBColor)],
) where
    DB::ErrorType: 'static,
{
    let words = ("sans-serif", SMALL).into_font().color(&INK);
    for (i, (name, ink)) in entries.iter().enumerate() {
        let y = top + 18 * i as i32;
        area.draw(&Rectangle::new([(left, y), (left + 12, y + 10)], ink.filled())).expect("mark");
        area.draw(&Text::new(name.clone(), (left + 20, y - 2), words.clone())).expect("text");
    }
    let y = top + 18 * entries.len() as i32 + 6;
    for (i, line) in
        ["● worst found by search   ○ root mean square", "▲ certified: no state is worse   — to the right: cold"]
            .iter()
            .enumerate()
    {
        area.draw(&Text::new(*line, (left, y + 17 * i as i32), words.clone())).expect("text");
    }
}

/// The same as a table.
pub fn table(panel: &Panel) -> String {
    let mut text = format!(
        "# {}: {}, time against error\n\n`cargo bench -p straightline-generated-tests --bench time_error -- function {} {}`\n\n\
         Compiled for the processor of the machine, which was shared with other work while this ran: compare within the table. Errors over the greatest\n\
         output in the limits of the joints. {}.\n\n\
         | method | warm, ns | median | cold, ns | rms error | worst found | certified |\n|---|---|---|---|---|---|---|\n",
        panel.robot,
        panel.function.name(),
        panel.robot,
        panel.function.name(),
        panel.notes.join("; ")
    );
    for m in &panel.methods {
        let cap = m.cap.map_or("–".to_string(), |c| format!("{c:.1e}"));
        let _ = writeln!(
            text,
            "| {} | {:.1} | {:.1} | {:.0} | {:.1e} | {:.1e} | {cap} |",
            m.name, m.time[0], m.time[1], m.time[2], m.rms, m.worst
        );
    }
    text
}

/// One curve of a chart with lines.
pub struct Curve {
    pub name: String,
    pub colour: usize,
    /// Dashed, for what belongs together in colour but not in kind.
    pub dashed: bool,
    pub points: Vec<(f64, f64)>,
}

/// A chart of curves, both axes logarithmic.
pub struct Curves<'a> {
    pub title: &'a str,
    pub x: &'a str,
    /// Where the x axis has its marks: at powers of this.
    pub x_base: f64,
    pub y: &'a str,
    pub x_format: &'a dyn Fn(&f64) -> String,
    pub y_format: &'a dyn Fn(&f64) -> String,
    pub curves: &'a [Curve],
}

/// Draws charts one below the other.
pub fn curves(charts: &[Curves], path: &Path) {
    let (width, each) = (1100, 520);
    let area = SVGBackend::new(path, (width, each * charts.len() as u32)).into_drawing_area();
    area.fill(&WHITE).expect("the picture can be written");
    for (row, c) in area.split_evenly((charts.len(), 1)).iter().zip(charts) {
        let all = || c.curves.iter().flat_map(|c| &c.points).filter(|p| p.1 > 0.0);
        let range = |of: fn(&(f64, f64)) -> f64| {
            let (low, high) = all().map(of).fold((f64::MAX, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
            low / 1.5..high * 1.5
        };
        row.draw(&Text::new(c.title, (24, 14), ("sans-serif", TITLE).into_font().color(&INK))).expect("text");
        let (plot, _) = row.split_horizontally(width as i32 - 300);
        let mut chart = ChartBuilder::on(&plot)
            .margin_top(50)
            .margin_bottom(12)
            .margin_left(14)
            .x_label_area_size(50)
            .y_label_area_size(74)
            .build_cartesian_2d(range(|p| p.0).log_scale().base(c.x_base), range(|p| p.1).log_scale())
            .expect("ranges");
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(PALE)
            .axis_style(INK)
            .x_desc(c.x)
            .y_desc(c.y)
            .axis_desc_style(("sans-serif", WORDS).into_font().color(&INK))
            .label_style(("sans-serif", SMALL).into_font().color(&INK))
            .x_label_formatter(&|x| (c.x_format)(x))
            .y_label_formatter(&|y| (c.y_format)(y))
            .draw()
            .expect("axes");
        let mut ends = Vec::new();
        for (i, curve) in c.curves.iter().enumerate() {
            let ink = COLOURS[curve.colour % COLOURS.len()];
            let points: Vec<(f64, f64)> = curve.points.iter().copied().filter(|p| p.1 > 0.0).collect();
            if curve.dashed {
                chart.draw_series(DashedLineSeries::new(points.clone(), 7, 5, ink.stroke_width(2))).expect("line");
            } else {
                chart.draw_series(LineSeries::new(points.clone(), ink.stroke_width(2))).expect("line");
            }
            chart.draw_series(points.iter().map(|p| Circle::new(*p, 3, ink.filled()))).expect("dots");
            // the end at the right
            if let Some(end) = points.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
                ends.push((i, chart.backend_coord(end)));
            }
        }
        let (_, top) = row.get_base_pixel();
        let places = ends.iter().map(|(i, at)| (*i, at.1 - top)).collect();
        let left = width as i32 - 300;
        for (i, y) in spread(places, 17, 50, each as i32 - 70) {
            let curve = &c.curves[i];
            let ink = COLOURS[curve.colour % COLOURS.len()];
            let (x0, y0) = ends.iter().find(|e| e.0 == i).expect("it has an end").1;
            let line = vec![(x0 + 5, y0 - top), (left - 8, y), (left + 4, y)];
            row.draw(&PathElement::new(line, ink.mix(0.3).stroke_width(1))).expect("line");
            row.draw(&Text::new(
                curve.name.clone(),
                (left + 8, y - 7),
                ("sans-serif", SMALL + 1).into_font().color(&ink),
            ))
            .expect("text");
        }
    }
    area.present().expect("the picture can be written");
    println!("{}", path.display());
}
