//! SVG elements, in the order in which they are drawn.

use std::fmt::{Arguments, Write};

/// Distinguishable by people with any colour vision (Okabe and Ito 2008).
pub const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// A drawing, self-contained. Lengths are those of its view.
#[derive(Debug)]
pub struct Svg {
    text: String,
}

impl Svg {
    /// `view`: left, top, width, height; `font`: size of letters.
    pub fn new([left, top, width, height]: [f64; 4], font: f64) -> Self {
        let mut svg = Self { text: String::new() };
        svg.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"{left} {top} {width} {height}\" font-family=\"sans-serif\" font-size=\"{font}\">\n"
        ));
        svg.rectangle([left, top], [width, height], "#fff");
        svg
    }

    /// An element as it is.
    pub fn put(&mut self, element: Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.text.write_fmt(element);
    }

    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], colour: &str, width: f64) {
        self.put(format_args!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{colour}\" stroke-width=\"{width:.2}\"/>\n"
        ));
    }

    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str) {
        self.put(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{fill}\"/>\n"
        ));
    }

    pub fn outline(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], colour: &str) {
        self.put(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" stroke=\"{colour}\"/>\n"
        ));
    }

    pub fn circle(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str) {
        self.put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{fill}\"/>\n"));
    }

    /// Two strokes through a point.
    pub fn cross(&mut self, [x, y]: [f64; 2], radius: f64, colour: &str, width: f64) {
        self.line([x - radius, y - radius], [x + radius, y + radius], colour, width);
        self.line([x - radius, y + radius], [x + radius, y - radius], colour, width);
    }

    pub fn polyline(&mut self, points: &[[f64; 2]], colour: &str, width: f64, dashed: bool) {
        let dash = if dashed { " stroke-dasharray=\"6 4\"" } else { "" };
        let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        self.put(format_args!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{dash}/>\n",
            path.join(" ")
        ));
    }

    /// `anchor`: start, middle or end.
    pub fn text(&mut self, [x, y]: [f64; 2], anchor: &str, text: &str) {
        self.put(format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>\n", escape(text)));
    }

    pub fn coloured_text(&mut self, [x, y]: [f64; 2], text: &str, colour: &str) {
        self.put(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" fill=\"{colour}\">{}</text>\n",
            escape(text)
        ));
    }

    /// Upwards.
    pub fn turned_text(&mut self, [x, y]: [f64; 2], text: &str) {
        self.put(format_args!(
            "<text x=\"{x}\" y=\"{y:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 {x} {y:.1})\">{}</text>\n",
            escape(text)
        ));
    }

    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

/// Text as it may stand in XML and HTML, in elements and in attributes.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
