//! Rows of numbers that flow past.

/// Numbers a cache line.
const LINE: usize = 16;

/// Zeros from the start of a cache line on: vectors that lie across two take twice the time to load.
pub struct Aligned {
    data: Vec<f32>,
    start: usize,
    length: usize,
}

impl Aligned {
    pub fn new(length: usize) -> Self {
        let data = vec![0.0; length + LINE];
        // Of no consequence but for time.
        let start = data.as_ptr().align_offset(size_of::<f32>() * LINE).min(LINE);
        Self { data, start, length }
    }

    #[inline]
    pub fn all(&self) -> &[f32] {
        &self.data[self.start..self.start + self.length]
    }

    #[inline]
    pub fn all_mut(&mut self) -> &mut [f32] {
        &mut self.data[self.start..self.start + self.length]
    }
}

/// The last rows of a level.
pub struct Rows {
    data: Aligned,
    stride: usize,
    capacity: usize,
    /// Rows that were written so far: the next one's number.
    next: usize,
}

impl Rows {
    pub fn new(stride: usize, capacity: usize) -> Self {
        Self { data: Aligned::new(stride * capacity), stride, capacity, next: 0 }
    }

    /// Row `y`, one of the last `capacity`, with its padding.
    #[inline]
    pub fn row(&self, y: usize) -> &[f32] {
        debug_assert!(y < self.next && y + self.capacity >= self.next);
        let start = (y % self.capacity) * self.stride;
        &self.data.all()[start..start + self.stride]
    }

    /// How many there were so far.
    pub fn count(&self) -> usize {
        self.next
    }

    /// Makes room for the next `n` rows.
    pub fn extend(&mut self, n: usize) {
        self.next += n;
    }

    pub fn row_mut(&mut self, y: usize) -> &mut [f32] {
        debug_assert!(y < self.next && y + self.capacity >= self.next);
        let start = (y % self.capacity) * self.stride;
        &mut self.data.all_mut()[start..start + self.stride]
    }

    /// Room for the next row.
    pub fn push(&mut self) -> &mut [f32] {
        self.extend(1);
        self.row_mut(self.next - 1)
    }
}
