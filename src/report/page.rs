//! HTML: the page's frame and style, tables, figures, and numbers with what they are sure of.

use crate::draw::significant;
pub use crate::draw::svg::escape;

/// For paper, screens and telephones: figures flow into as many columns as there is room for.
const STYLE: &str = "\
:root{color-scheme:light}\
body{font:16px/1.5 system-ui,sans-serif;color:#111;background:#fff;max-width:1080px;margin:0 auto;padding:16px}\
h1{font-size:1.7em;line-height:1.2;margin:.4em 0}h2{border-top:2px solid #111;padding-top:.4em;margin-top:1.6em}\
h3{margin:1.2em 0 .3em}.made{color:#555;margin-top:0}\
.wide{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.93em}\
th,td{padding:3px 12px 3px 0;text-align:left;vertical-align:top;border-bottom:1px solid #ddd}\
td.n,th.n{text-align:right;white-space:nowrap}\
.good{border-left:6px solid #009e73;padding-left:10px}.doubt{border-left:6px solid #d55e00;padding-left:10px}\
.figures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,330px),1fr));gap:20px}\
figure{margin:0;break-inside:avoid}figure.full{grid-column:1/-1}figure svg{width:100%;height:auto;display:block}\
figure.full svg{max-width:640px}\
figcaption{font-size:.88em;color:#333;margin-top:4px}code{font-size:.82em;overflow-wrap:anywhere}\
@media (max-width:520px){table{font-size:.8em}th,td{padding-right:8px}}\
@media print{body{font-size:11px;max-width:none;padding:0}.figures{grid-template-columns:1fr 1fr}\
section{break-inside:auto}h2,h3{break-after:avoid}tr{break-inside:avoid}.wide{overflow:visible}}";

/// A page that is written from top to bottom.
pub struct Page {
    html: String,
}

impl Page {
    pub fn new(title: &str) -> Self {
        let title = escape(title);
        Self {
            html: format!(
                "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
                 <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
                 <title>{title}</title>\n<style>{STYLE}</style></head>\n<body>\n"
            ),
        }
    }

    pub fn put(&mut self, html: &str) {
        self.html.push_str(html);
    }

    pub fn finish(mut self) -> String {
        self.html.push_str("</body></html>\n");
        self.html
    }
}

/// A table whose cells are HTML; columns from `numbers` on are numbers.
pub fn table(head: &[&str], rows: &[Vec<String>], numbers: usize) -> String {
    let class = |column: usize| if column >= numbers { " class=\"n\"" } else { "" };
    let mut html = String::from("<div class=\"wide\"><table>\n<tr>");
    for (column, title) in head.iter().enumerate() {
        html += &format!("<th{}>{}</th>", class(column), escape(title));
    }
    html += "</tr>\n";
    for row in rows {
        html += "<tr>";
        for (column, cell) in row.iter().enumerate() {
            html += &format!("<td{}>{cell}</td>", class(column));
        }
        html += "</tr>\n";
    }
    html + "</table></div>\n"
}

/// A drawing with the sentence that says what is to be seen in it.
pub fn figure(svg: &str, caption: &str) -> String {
    format!("<figure>{svg}<figcaption>{}</figcaption></figure>\n", escape(caption))
}

/// A drawing over the whole width.
pub fn wide_figure(svg: &str, caption: &str) -> String {
    format!("<figure class=\"full\">{svg}<figcaption>{}</figcaption></figure>\n", escape(caption))
}

/// What a person should know, or that all is well.
pub fn verdict(warnings: &[String], well: &str) -> String {
    if warnings.is_empty() {
        return format!("<p class=\"good\">{}</p>\n", escape(well));
    }
    let items: String = warnings.iter().map(|w| format!("<li>{}</li>", escape(w))).collect();
    format!("<div class=\"doubt\"><strong>To know before it is used:</strong><ul>{items}</ul></div>\n")
}

/// A value with its standard deviation to two digits, "fixed" where it has none.
pub fn measured(value: f64, sigma: f64) -> [String; 2] {
    if !value.is_finite() || !sigma.is_finite() {
        return [number(value), "unknown".into()];
    }
    if sigma <= 0.0 {
        return [number(value), "fixed".into()];
    }
    let digits = (1 - sigma.log10().floor() as i32).clamp(0, 12) as usize;
    [format!("{value:.digits$}"), format!("{sigma:.digits$}")]
}

/// Six digits, with an exponent where that is shorter.
pub fn number(value: f64) -> String {
    if value.is_finite() && value != 0.0 && !(1e-4..1e7).contains(&value.abs()) {
        return format!("{value:.5e}");
    }
    significant(value, 6)
}

/// "1 shot", "3 shots".
pub fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// At most `most` of them, evenly taken.
pub fn thinned<T: Copy>(all: &[T], most: usize) -> Vec<T> {
    let step = all.len().div_ceil(most).max(1);
    all.iter().step_by(step).copied().collect()
}

/// Says what [`thinned`] left out.
pub fn thinned_note(all: usize, most: usize) -> String {
    let step = all.div_ceil(most).max(1);
    if step > 1 { format!(" One of {step} is drawn.") } else { String::new() }
}
