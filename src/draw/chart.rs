//! Charts as self-contained SVG: lines and points over two axes, and tables of numbers as colours.

use super::axis::{Scale, short};
use super::svg::{COLOURS, Svg};

/// Where things are on a chart.
#[derive(Debug, Clone, Copy)]
struct Layout {
    width: f64,
    height: f64,
    /// Room around the plot for labels: left, right, top, bottom.
    margin: [f64; 4],
    /// Corner of the first entry of the legend.
    legend: [f64; 2],
}

impl Layout {
    /// For a page of its own: the legend beside the plot.
    const WIDE: Self = Self { width: 760.0, height: 480.0, margin: [84.0, 190.0, 46.0, 64.0], legend: [584.0, 58.0] };

    /// For a column of a page, a telephone: the legend below.
    fn compact(entries: usize) -> Self {
        let legend = 18.0 * entries as f64;
        let height = 340.0 + legend;
        Self { width: 440.0, height, margin: [68.0, 14.0, 34.0, 54.0 + legend], legend: [72.0, height - legend] }
    }

    fn x(&self, share: f64) -> f64 {
        self.margin[0] + share * (self.width - self.margin[0] - self.margin[1])
    }

    fn y(&self, share: f64) -> f64 {
        self.height - self.margin[3] - share * (self.height - self.margin[2] - self.margin[3])
    }

    /// An empty drawing with its title.
    fn begin(&self, title: &str) -> Svg {
        let mut svg = Svg::new([0.0, 0.0, self.width, self.height], 12.0);
        let middle = 0.5 * (self.x(0.0) + self.x(1.0));
        let baseline = self.margin[2] - 18.0;
        svg.put(format_args!(
            "<text x=\"{middle:.1}\" y=\"{baseline}\" text-anchor=\"middle\" font-size=\"15\">{}</text>\n",
            super::svg::escape(title)
        ));
        svg
    }

    /// The plot's border and the axes' labels.
    fn frame(&self, svg: &mut Svg, x_label: &str, y_label: &str) {
        let [left, right, bottom, top] = [self.x(0.0), self.x(1.0), self.y(0.0), self.y(1.0)];
        svg.outline([left, top], [right - left, bottom - top], "#000");
        svg.text([0.5 * (left + right), bottom + 40.0], "middle", x_label);
        svg.turned_text([18.0, 0.5 * (bottom + top)], y_label);
    }

    /// Widens the axis that has more pixels a unit.
    fn equalise(&self, scales: &mut [Scale; 2]) {
        let pixels = [self.x(1.0) - self.x(0.0), self.y(0.0) - self.y(1.0)];
        let units = [0, 1].map(|k| (scales[k].high - scales[k].low) / pixels[k]);
        let unit = units[0].max(units[1]);
        for (scale, pixels) in scales.iter_mut().zip(pixels) {
            let (middle, half) = (0.5 * (scale.low + scale.high), 0.5 * unit * pixels);
            (scale.low, scale.high) = (middle - half, middle + half);
        }
    }
}

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// With its unit.
    pub label: String,
    /// Logarithmic; only positive values are drawn.
    pub log: bool,
}

impl Axis {
    /// `label`: with its unit.
    pub fn linear(label: &str) -> Self {
        Self { label: label.into(), log: false }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    Line,
    Dashed,
    Dots,
    /// From zero to the values, as wide as the first two are apart: a histogram.
    Bars,
    /// Crosses.
    Crosses,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    /// Those that are not finite are left out.
    pub points: Vec<[f64; 2]>,
    pub mark: Mark,
    /// Series with the same number share a colour.
    pub colour: usize,
}

/// Lines and points over two axes, with a legend beside them.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
    /// The same unit length on both axes: maps.
    pub equal: bool,
}

/// A table of numbers as colours, the numbers written in.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    pub title: String,
    pub x_label: String,
    pub y_label: String,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// `values[j][i]` belongs to `x[i]`, `y[j]`.
    pub values: Vec<Vec<f64>>,
}

impl Chart {
    /// For a page of its own.
    pub fn to_svg(&self) -> String {
        self.draw(&Layout::WIDE)
    }

    /// For a column of a page.
    pub fn to_compact_svg(&self) -> String {
        self.draw(&Layout::compact(self.series.iter().filter(|s| !s.name.is_empty()).count()))
    }

    fn draw(&self, layout: &Layout) -> String {
        let mut svg = layout.begin(&self.title);
        let drawn = |s: &Series| -> Vec<[f64; 2]> {
            let visible = |axis: &Axis, v: f64| v.is_finite() && (!axis.log || v > 0.0);
            s.points.iter().copied().filter(|[x, y]| visible(&self.x, *x) && visible(&self.y, *y)).collect()
        };
        let all: Vec<[f64; 2]> = self.series.iter().flat_map(drawn).collect();
        let bars = self.series.iter().any(|s| s.mark == Mark::Bars);
        let base = bars.then_some([f64::NAN, 0.0]);
        let values = |k: usize| all.iter().chain(&base).map(move |p| p[k]);
        let mut scales = [Scale::new(self.x.log, values(0)), Scale::new(self.y.log, values(1))];
        if self.equal {
            layout.equalise(&mut scales);
        }
        let place = |[x, y]: [f64; 2]| [layout.x(scales[0].share(x)), layout.y(scales[1].share(y))];
        for (value, label) in scales[0].ticks() {
            let x = layout.x(scales[0].share(value));
            svg.line([x, layout.y(0.0)], [x, layout.y(1.0)], "#ddd", 1.0);
            svg.text([x, layout.y(0.0) + 18.0], "middle", &label);
        }
        for (value, label) in scales[1].ticks() {
            let y = layout.y(scales[1].share(value));
            svg.line([layout.x(0.0), y], [layout.x(1.0), y], "#ddd", 1.0);
            svg.text([layout.x(0.0) - 8.0, y + 4.0], "end", &label);
        }
        layout.frame(&mut svg, &self.x.label, &self.y.label);
        let [x, mut y] = layout.legend;
        for series in &self.series {
            let colour = COLOURS[series.colour % COLOURS.len()];
            let points: Vec<_> = drawn(series).into_iter().map(place).collect();
            let floor = layout.y(scales[1].share(0.0).max(0.0));
            put_series(&mut svg, &points, series.mark, colour, floor);
            if series.name.is_empty() {
                continue;
            }
            let sample = [[x, y - 4.0], [x + 26.0, y - 4.0]];
            match series.mark {
                Mark::Bars => svg.rectangle([x + 6.0, y - 11.0], [14.0, 11.0], colour),
                Mark::Dots | Mark::Crosses => put_series(&mut svg, &sample[1..], series.mark, colour, y),
                Mark::Line | Mark::Dashed => put_series(&mut svg, &sample, series.mark, colour, y),
            }
            svg.text([x + 34.0, y], "start", &series.name);
            y += 18.0;
        }
        svg.finish()
    }
}

/// `floor`: where bars begin.
fn put_series(svg: &mut Svg, points: &[[f64; 2]], mark: Mark, colour: &str, floor: f64) {
    match mark {
        Mark::Line => {
            svg.polyline(points, colour, 2.0, false);
            points.iter().for_each(|p| svg.circle(*p, 3.0, colour));
        }
        Mark::Dashed => svg.polyline(points, colour, 2.0, true),
        Mark::Dots => points.iter().for_each(|p| svg.circle(*p, 2.2, colour)),
        Mark::Crosses => points.iter().for_each(|p| svg.cross(*p, 3.0, colour, 1.5)),
        Mark::Bars => {
            let width = if let [a, b, ..] = points { 0.9 * (b[0] - a[0]).abs() } else { 20.0 };
            for [x, y] in points {
                svg.rectangle([x - 0.5 * width, y.min(floor)], [width, (floor - y).abs()], colour);
            }
        }
    }
}

impl HeatMap {
    /// For a page of its own.
    pub fn to_svg(&self) -> String {
        self.draw(&Layout::WIDE)
    }

    /// For a column of a page.
    pub fn to_compact_svg(&self) -> String {
        self.draw(&Layout::compact(0))
    }

    fn draw(&self, layout: &Layout) -> String {
        let mut svg = layout.begin(&self.title);
        let finite: Vec<f64> = self.values.iter().flatten().copied().filter(|v| v.is_finite()).collect();
        let greatest = finite.iter().fold(0.0f64, |a, b| a.max(*b)).max(f64::MIN_POSITIVE);
        let (columns, rows) = (self.x.len().max(1) as f64, self.y.len().max(1) as f64);
        for (j, row) in self.values.iter().enumerate().take(self.y.len()) {
            for (i, value) in row.iter().enumerate().take(self.x.len()) {
                let [left, right] = [i, i + 1].map(|k| layout.x(k as f64 / columns));
                let [bottom, top] = [j, j + 1].map(|k| layout.y(k as f64 / rows));
                let share = if value.is_finite() { (value / greatest).clamp(0.0, 1.0).sqrt() } else { 1.0 };
                svg.rectangle([left, top], [right - left, bottom - top], &shade(share));
                let ink = if share > 0.6 { "#fff" } else { "#000" };
                svg.coloured_text([(left + right) / 2.0, (top + bottom) / 2.0 + 4.0], &short(*value), ink);
            }
        }
        for (i, x) in self.x.iter().enumerate() {
            svg.text([layout.x((i as f64 + 0.5) / columns), layout.y(0.0) + 18.0], "middle", &short(*x));
        }
        for (j, y) in self.y.iter().enumerate() {
            svg.text([layout.x(0.0) - 8.0, layout.y((j as f64 + 0.5) / rows) + 4.0], "end", &short(*y));
        }
        layout.frame(&mut svg, &self.x_label, &self.y_label);
        svg.finish()
    }
}

/// White to dark blue.
fn shade(share: f64) -> String {
    let mix = |light: f64, dark: f64| (light + (dark - light) * share).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(255.0, 8.0), mix(255.0, 48.0), mix(255.0, 107.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(label: &str, log: bool) -> Axis {
        Axis { label: label.into(), log }
    }

    fn attribute<'a>(svg: &'a str, element: &str, name: &str) -> Vec<&'a str> {
        svg.lines()
            .filter(|l| l.starts_with(&format!("<{element} ")))
            .filter_map(|l| l.split(&format!(" {name}=\"")).nth(1)?.split('"').next())
            .collect()
    }

    #[test]
    fn points_are_drawn_where_their_values_are() {
        let points = vec![[0.0, 1.0], [5.0, 100.0], [10.0, 10.0], [f64::NAN, 1.0], [1.0, -1.0]];
        let series = vec![Series { name: "a < b".into(), points, mark: Mark::Line, colour: 0 }];
        let chart = Chart { title: "t".into(), x: axis("x (m)", false), y: axis("y (mm)", true), series, equal: false };
        let svg = chart.to_svg();
        // Those without a place are left out; two circles are the legend's.
        let (cx, cy) = (attribute(&svg, "circle", "cx"), attribute(&svg, "circle", "cy"));
        assert_eq!(cx.len(), 5);
        let number = |s: &str| s.parse::<f64>().unwrap();
        let (x, y): (Vec<f64>, Vec<f64>) =
            (cx.iter().map(|s| number(s)).collect(), cy.iter().map(|s| number(s)).collect());
        assert!((x[1] - x[0] - (x[2] - x[1])).abs() < 0.2, "evenly spaced on a linear axis");
        assert!((y[0] - y[2] - (y[2] - y[1])).abs() < 0.2, "decades on a logarithmic one");
        assert!(y[1] < y[2] && y[2] < y[0], "up is more");
        assert!(svg.contains("a &lt; b") && svg.contains("x (m)") && svg.contains("y (mm)"));
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    }

    #[test]
    fn a_map_has_the_same_unit_on_both_axes() {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let series = vec![Series { name: "s".into(), points, mark: Mark::Dots, colour: 1 }];
        let svg =
            Chart { title: String::new(), x: axis("x", false), y: axis("y", false), series, equal: true }.to_svg();
        let place = |name| -> Vec<f64> { attribute(&svg, "circle", name).iter().map(|s| s.parse().unwrap()).collect() };
        let (x, y) = (place("cx"), place("cy"));
        assert!((x[1] - x[0] - (y[0] - y[2])).abs() < 0.2);
    }

    #[test]
    fn a_heat_map_writes_its_numbers() {
        let values = vec![vec![0.0, 0.25], vec![12.345, f64::INFINITY]];
        let map = HeatMap {
            title: "m".into(),
            x_label: "x".into(),
            y_label: "y".into(),
            x: vec![1.0, 2.0],
            y: vec![3.0, 4.0],
            values,
        };
        let svg = map.to_svg();
        for text in [">0<", ">0.25<", ">12.3<", ">-<"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(attribute(&svg, "rect", "fill").len(), 6);
    }
}
