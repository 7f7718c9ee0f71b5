//! One measured figure, and what it is held against.

/// One measured figure.
pub struct Figure {
    /// As the mathematics notes name it, or the wording.
    pub goal: &'static str,
    pub setup: String,
    pub figure: f64,
    pub unit: &'static str,
    /// What it is held against: the Cramer-Rao bound or the truth's tolerance.
    pub bound: f64,
    /// figure / bound, or the figure itself where it already is a ratio.
    pub ratio: f64,
    pub limit: f64,
    pub runs: usize,
}

impl Figure {
    pub fn met(&self) -> bool {
        self.ratio <= self.limit
    }
}
