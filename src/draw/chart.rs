//! Charts as self-contained SVG: lines and points over two axes, and tables of numbers as colours.

use std::fmt::Write;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 480.0;
/// Room around the plot for labels: left, right, top, bottom.
const MARGIN: [f64; 4] = [84.0, 190.0, 46.0, 64.0];
/// Distinguishable by people with any colour vision (Okabe and Ito 2008).
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// With its unit.
    pub label: String,
    /// Logarithmic; only positive values are drawn.
    pub log: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    Line,
    Dashed,
    Dots,
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
    pub fn to_svg(&self) -> String {
        let mut page = Page::new(&self.title);
        let drawn = |s: &Series| -> Vec<[f64; 2]> {
            let visible = |axis: &Axis, v: f64| v.is_finite() && (!axis.log || v > 0.0);
            s.points.iter().copied().filter(|[x, y]| visible(&self.x, *x) && visible(&self.y, *y)).collect()
        };
        let all: Vec<[f64; 2]> = self.series.iter().flat_map(drawn).collect();
        let mut scales = [(&self.x, 0), (&self.y, 1)].map(|(axis, k)| Scale::new(axis.log, all.iter().map(|p| p[k])));
        if self.equal {
            equalise(&mut scales);
        }
        let place = |[x, y]: [f64; 2]| [Page::x(scales[0].share(x)), Page::y(scales[1].share(y))];
        for (value, label) in scales[0].ticks() {
            let x = Page::x(scales[0].share(value));
            page.line([x, Page::y(0.0)], [x, Page::y(1.0)], "#ddd");
            page.text(x, Page::y(0.0) + 18.0, "middle", &label);
        }
        for (value, label) in scales[1].ticks() {
            let y = Page::y(scales[1].share(value));
            page.line([Page::x(0.0), y], [Page::x(1.0), y], "#ddd");
            page.text(Page::x(0.0) - 8.0, y + 4.0, "end", &label);
        }
        page.frame(&self.x.label, &self.y.label);
        for (k, series) in self.series.iter().enumerate() {
            let colour = COLOURS[series.colour % COLOURS.len()];
            let points: Vec<_> = drawn(series).into_iter().map(place).collect();
            page.series(&points, series.mark, colour);
            let y = MARGIN[2] + 12.0 + 20.0 * k as f64;
            let x = WIDTH - MARGIN[1] + 14.0;
            let sample = [[x, y - 4.0], [x + 26.0, y - 4.0]];
            page.series(if series.mark == Mark::Dots { &sample[1..] } else { &sample }, series.mark, colour);
            page.text(x + 34.0, y, "start", &series.name);
        }
        page.finish()
    }
}

impl HeatMap {
    pub fn to_svg(&self) -> String {
        let mut page = Page::new(&self.title);
        let finite: Vec<f64> = self.values.iter().flatten().copied().filter(|v| v.is_finite()).collect();
        let greatest = finite.iter().fold(0.0f64, |a, b| a.max(*b)).max(f64::MIN_POSITIVE);
        let (columns, rows) = (self.x.len().max(1) as f64, self.y.len().max(1) as f64);
        for (j, row) in self.values.iter().enumerate().take(self.y.len()) {
            for (i, value) in row.iter().enumerate().take(self.x.len()) {
                let [left, right] = [i, i + 1].map(|k| Page::x(k as f64 / columns));
                let [bottom, top] = [j, j + 1].map(|k| Page::y(k as f64 / rows));
                let share = if value.is_finite() { (value / greatest).clamp(0.0, 1.0).sqrt() } else { 1.0 };
                page.rectangle([left, top], [right - left, bottom - top], &shade(share));
                let ink = if share > 0.6 { "#fff" } else { "#000" };
                page.coloured_text([(left + right) / 2.0, (top + bottom) / 2.0 + 4.0], &short(*value), ink);
            }
        }
        for (i, x) in self.x.iter().enumerate() {
            page.text(Page::x((i as f64 + 0.5) / columns), Page::y(0.0) + 18.0, "middle", &short(*x));
        }
        for (j, y) in self.y.iter().enumerate() {
            page.text(Page::x(0.0) - 8.0, Page::y((j as f64 + 0.5) / rows) + 4.0, "end", &short(*y));
        }
        page.frame(&self.x_label, &self.y_label);
        page.finish()
    }
}

/// White to dark blue.
fn shade(share: f64) -> String {
    let mix = |light: f64, dark: f64| (light + (dark - light) * share).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(255.0, 8.0), mix(255.0, 48.0), mix(255.0, 107.0))
}

/// Three digits.
fn short(v: f64) -> String {
    if !v.is_finite() {
        return "-".into();
    }
    let digits = if v == 0.0 { 0 } else { (2 - v.abs().log10().floor() as i32).clamp(0, 9) };
    let text = format!("{v:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// From values to the share of an axis's length.
struct Scale {
    log: bool,
    low: f64,
    high: f64,
}

impl Scale {
    /// Over all values, with some air; a linear one of values above zero begins at zero where that is near.
    fn new(log: bool, values: impl Iterator<Item = f64>) -> Self {
        let mapped = values.map(|v| if log { v.log10() } else { v });
        let (mut low, mut high) = mapped.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if !log && low > 0.0 && low < 0.5 * high {
            low = 0.0;
        }
        let air = if high > low { 0.04 * (high - low) } else { 0.5 * high.abs().max(1.0) };
        let below = if !log && low == 0.0 { 0.0 } else { air };
        Self { log, low: low - below, high: high + air }
    }

    fn share(&self, value: f64) -> f64 {
        let v = if self.log { value.log10() } else { value };
        (v - self.low) / (self.high - self.low)
    }

    /// Round numbers within.
    fn ticks(&self) -> Vec<(f64, String)> {
        let mut ticks = Vec::new();
        if self.log {
            let wide = self.high - self.low > 3.0;
            for decade in self.low.floor() as i32..=self.high.ceil() as i32 {
                for digit in if wide { [1.0].as_slice() } else { [1.0, 2.0, 5.0].as_slice() } {
                    ticks.push(digit * 10f64.powi(decade));
                }
            }
        } else {
            let rough = (self.high - self.low) / 6.0;
            let unit = 10f64.powf(rough.log10().floor());
            let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * unit).find(|s| *s >= rough).unwrap_or(rough);
            let first = (self.low / step).ceil() as i64;
            ticks.extend((0..20).map(|k| (first + k) as f64 * step));
        }
        ticks.retain(|t| (-1e-9..=1.0 + 1e-9).contains(&self.share(*t)));
        ticks.into_iter().map(|t| (t, short(if t.abs() < 1e-12 { 0.0 } else { t }))).collect()
    }
}

/// Widens the axis that has more pixels a unit.
fn equalise(scales: &mut [Scale; 2]) {
    let pixels = [Page::x(1.0) - Page::x(0.0), Page::y(0.0) - Page::y(1.0)];
    let units = [0, 1].map(|k| (scales[k].high - scales[k].low) / pixels[k]);
    let unit = units[0].max(units[1]);
    for (scale, pixels) in scales.iter_mut().zip(pixels) {
        let (middle, half) = (0.5 * (scale.low + scale.high), 0.5 * unit * pixels);
        (scale.low, scale.high) = (middle - half, middle + half);
    }
}

/// The drawing: elements in their order.
struct Page {
    svg: String,
}

impl Page {
    fn new(title: &str) -> Self {
        let mut page = Self { svg: String::new() };
        page.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
        ));
        let middle = 0.5 * (Self::x(0.0) + Self::x(1.0));
        page.put(format_args!(
            "<text x=\"{middle:.1}\" y=\"28\" text-anchor=\"middle\" font-size=\"15\">{}</text>\n",
            escape(title)
        ));
        page
    }

    fn put(&mut self, what: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.svg.write_fmt(what);
    }

    fn x(share: f64) -> f64 {
        MARGIN[0] + share * (WIDTH - MARGIN[0] - MARGIN[1])
    }

    fn y(share: f64) -> f64 {
        HEIGHT - MARGIN[3] - share * (HEIGHT - MARGIN[2] - MARGIN[3])
    }

    fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], colour: &str) {
        self.put(format_args!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{colour}\"/>\n"
        ));
    }

    fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str) {
        self.put(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{fill}\"/>\n"
        ));
    }

    fn text(&mut self, x: f64, y: f64, anchor: &str, text: &str) {
        self.put(format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>\n", escape(text)));
    }

    fn coloured_text(&mut self, [x, y]: [f64; 2], text: &str, colour: &str) {
        self.put(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" fill=\"{colour}\">{}</text>\n",
            escape(text)
        ));
    }

    /// The plot's border and the axes' labels.
    fn frame(&mut self, x_label: &str, y_label: &str) {
        let [left, right, bottom, top] = [Self::x(0.0), Self::x(1.0), Self::y(0.0), Self::y(1.0)];
        self.put(format_args!(
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"#000\"/>\n",
            right - left,
            bottom - top
        ));
        self.text(0.5 * (left + right), bottom + 44.0, "middle", x_label);
        let middle = 0.5 * (bottom + top);
        self.put(format_args!(
            "<text x=\"20\" y=\"{middle:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 20 {middle:.1})\">{}</text>\n",
            escape(y_label)
        ));
    }

    fn series(&mut self, points: &[[f64; 2]], mark: Mark, colour: &str) {
        if mark != Mark::Dots {
            let dash = if mark == Mark::Dashed { " stroke-dasharray=\"6 4\"" } else { "" };
            let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            self.put(format_args!(
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/>\n",
                path.join(" ")
            ));
        }
        if mark != Mark::Dashed {
            let radius = if mark == Mark::Dots { 2.2 } else { 3.0 };
            for [x, y] in points {
                self.put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{colour}\"/>\n"));
            }
        }
    }

    fn finish(mut self) -> String {
        self.svg.push_str("</svg>\n");
        self.svg
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
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
    fn ticks_are_round_numbers_within_the_axis() {
        let labels = |log, low: f64, high: f64| -> Vec<String> {
            Scale::new(log, [low, high].into_iter()).ticks().into_iter().map(|(_, label)| label).collect()
        };
        assert_eq!(labels(false, 0.0, 5.0), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(labels(true, 0.1, 20.0), ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(labels(true, 1e-3, 1e3), ["0.001", "0.01", "0.1", "1", "10", "100", "1000"]);
        assert!(!labels(false, 3.0, 3.0).is_empty());
        assert!(!Scale::new(false, std::iter::empty()).ticks().is_empty());
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
