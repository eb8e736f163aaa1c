//! Lines over an axis, as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;

/// A line and its name.
pub struct Line<'a> {
    /// In the legend.
    pub name: &'a str,
    /// x and y.
    pub points: Vec<(f64, f64)>,
}

/// A plot.
pub struct Plot<'a> {
    /// Above it.
    pub title: &'a str,
    /// Below it and beside it.
    pub axes: (&'a str, &'a str),
    /// Its lines.
    pub lines: Vec<Line<'a>>,
    /// Levels that are limits: grey lines across.
    pub levels: Vec<f64>,
}

/// Points of a line, at most: no screen shows more.
const MOST_POINTS: usize = 2000;

/// Plots below each other, as SVG of this size in pixels.
///
/// # Errors
/// What the plotting library says.
pub fn stacked(plots: &[Plot], size: (u32, u32)) -> Result<String, String> {
    let mut svg = String::new();
    drawn(plots, &mut svg, size).map_err(|error| error.to_string())?;
    Ok(svg)
}

fn drawn(plots: &[Plot], svg: &mut String, size: (u32, u32)) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(svg, size).into_drawing_area();
    area.fill(&WHITE)?;
    // room for the names of the lines, the same in all, so that their axes stand below each other
    let has_names = plots.iter().any(|plot| plot.lines.len() > 1);
    for (plot, place) in plots.iter().zip(area.split_evenly((plots.len(), 1))) {
        plot.draw(&place, has_names)?;
    }
    area.present()?;
    Ok(())
}

impl Plot<'_> {
    /// The plot as SVG of this size in pixels.
    ///
    /// # Errors
    /// What the plotting library says.
    pub fn svg(&self, size: (u32, u32)) -> Result<String, String> {
        stacked(std::slice::from_ref(self), size)
    }

    fn draw(&self, area: &DrawingArea<SVGBackend, Shift>, has_room: bool) -> Result<(), Box<dyn std::error::Error>> {
        let finite = || self.lines.iter().flat_map(|l| &l.points).filter(|(x, y)| x.is_finite() && y.is_finite());
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            match low <= high {
                true => (low, high),
                false => (0.0, 1.0),
            }
        };
        let (left, right) = range(&mut finite().map(|p| p.0));
        let (low, high) = range(&mut finite().map(|p| p.1));
        // limits far beyond all values would flatten the lines
        let reach = (high - low).max(1e-12);
        let shown: Vec<f64> = self.levels.iter().copied().filter(|y| *y > low - reach && *y < high + reach).collect();
        let (low, high) = range(&mut [low, high].into_iter().chain(shown.iter().copied()));
        let margin = if high > low { 0.05 * (high - low) } else { low.abs().max(1.0) * 0.05 };
        let right = if right > left { right } else { left + 1.0 };
        // names of the lines stand beside the axes, which end where the lines end
        let (axes, names) = match has_room {
            true => {
                let (axes, names) = area.split_horizontally(82.percent_width());
                (axes, Some(names))
            }
            false => (area.clone(), None),
        };
        let mut chart = ChartBuilder::on(&axes)
            .caption(self.title, ("sans-serif", 16))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(64)
            .build_cartesian_2d(left..right, (low - margin)..(high + margin))?;
        chart.configure_mesh().light_line_style(WHITE).x_desc(self.axes.0).y_desc(self.axes.1).draw()?;
        for level in shown {
            let style = RGBColor(120, 120, 120).stroke_width(1);
            chart.draw_series(LineSeries::new([(left, level), (right, level)], style))?;
        }
        for (k, line) in self.lines.iter().enumerate() {
            let colour = Palette99::pick(k).to_rgba();
            let step = line.points.len().div_ceil(MOST_POINTS).max(1);
            let last = line.points.len().saturating_sub(1);
            let kept = line.points.iter().enumerate().filter(|(i, _)| i % step == 0 || *i == last);
            let points = kept.map(|(_, p)| *p).filter(|(x, y)| x.is_finite() && y.is_finite());
            chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
        }
        if let Some(names) = names.filter(|_| self.lines.len() > 1) {
            let height = names.dim_in_pixel().1 as i32;
            let step = ((height - 40) / self.lines.len() as i32).clamp(4, 18);
            for (k, line) in self.lines.iter().enumerate() {
                let y = 36 + step * k as i32;
                let colour = Palette99::pick(k).to_rgba();
                names.draw(&PathElement::new([(0, y), (16, y)], colour.stroke_width(2)))?;
                names.draw(&Text::new(line.name, (22, y - 7), ("sans-serif", 13)))?;
            }
        }
        Ok(())
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    /// The greatest x of the polylines of that width.
    fn rightmost(svg: &str, width: u32) -> f64 {
        let of_width = format!("stroke-width=\"{width}\"");
        let lines = svg.lines().filter(|l| l.starts_with("<polyline") && l.contains(&of_width));
        let points = lines.filter_map(|l| l.split("points=\"").nth(1)?.split('"').next());
        let numbers = points.flat_map(|p| p.split(' ')).filter_map(|p| p.split(',').next()?.parse::<f64>().ok());
        numbers.fold(f64::NEG_INFINITY, f64::max)
    }

    pub fn axes_end_where_the_run_ends_and_names_stand_beside_them() {
        let points = |slope: f64| (0..=100).map(|k| (f64::from(k) * 0.0137, slope * f64::from(k))).collect();
        let lines = vec![Line { name: "elbow", points: points(1.0) }, Line { name: "wrist", points: points(-1.0) }];
        let plot = Plot { title: "run", axes: ("t [s]", "rad"), lines, levels: Vec::new() };
        let svg = plot.svg((900, 340)).unwrap();
        let (axis, legend) = (rightmost(&svg, 1), rightmost(&svg, 2));
        // the swatches of the names lie right of the axes, the lines do not
        let line = svg.lines().find(|l| l.starts_with("<polyline") && l.matches(',').count() > 50).unwrap();
        let end = rightmost(line, 2);
        assert!((end - axis).abs() <= 1.0 && legend > axis + 10.0, "{end} {axis} {legend}");
        assert!(svg.contains("elbow") && svg.contains("wrist"));
    }
}
