//! Is all of a JPEG there? Decoders fill up what is missing, also when asked to be strict; this walks
//! through the Huffman codes (ITU-T T.81, annex F.2.2) and wants every block of the image.

/// Markers (T.81, table B.1).
const SOF_BASELINE: u8 = 0xc0;
const SOF_EXTENDED: u8 = 0xc1;
const DHT: u8 = 0xc4;
const RST: std::ops::RangeInclusive<u8> = 0xd0..=0xd7;
const EOI: u8 = 0xd9;
const SOS: u8 = 0xda;
const DRI: u8 = 0xdd;

/// `Some(true)` when every block is there, `Some(false)` when the data end earlier or are no codes of
/// their tables; `None` for files of another kind than cameras make (progressive, arithmetic), or
/// with headers that do not fit together.
pub fn is_complete(jpeg: &[u8]) -> Option<bool> {
    let mut image = Image::default();
    let mut rest = jpeg.get(2..)?;
    loop {
        let &[0xff, marker] = rest.get(..2)? else { return None };
        if marker == 0xff {
            rest = &rest[1..];
            continue;
        }
        if marker == EOI {
            return image.components.iter().all(|c| c.seen).then_some(true).or(Some(false));
        }
        let length = usize::from(u16::from_be_bytes([*rest.get(2)?, *rest.get(3)?]));
        let segment = rest.get(4..2 + length)?;
        rest = &rest[2 + length..];
        match marker {
            SOF_BASELINE | SOF_EXTENDED => image.read_frame(segment)?,
            0xc2..=0xcf if marker != DHT && marker != 0xc8 && marker != 0xcc => return None,
            DHT => image.read_tables(segment)?,
            DRI => image.restart = usize::from(u16::from_be_bytes([*segment.first()?, *segment.get(1)?])),
            SOS => {
                let mut bits = Bits { bytes: rest, held: 0, count: 0 };
                if image.walk_scan(segment, &mut bits)?.is_none() {
                    return Some(false);
                }
                // What is left of the scan, to the next marker.
                rest = bits.bytes;
                let end = rest.windows(2).position(|w| w[0] == 0xff && w[1] != 0 && !RST.contains(&w[1]))?;
                rest = &rest[end..];
            }
            _ => {}
        }
    }
}

#[derive(Default)]
struct Image {
    width: usize,
    height: usize,
    components: Vec<Component>,
    /// By class (0: DC, 1: AC) and number.
    tables: [[Option<Table>; 4]; 2],
    /// Units between restart markers; 0 without.
    restart: usize,
}

struct Component {
    id: u8,
    horizontal: usize,
    vertical: usize,
    seen: bool,
}

/// A code is within a length when it is not above its greatest one (T.81, figure F.16).
struct Table {
    max_code: [i32; 17],
    first: [i32; 17],
    values: Vec<u8>,
}

impl Image {
    fn read_frame(&mut self, segment: &[u8]) -> Option<()> {
        let &[_, h1, h0, w1, w0, count, ref components @ ..] = segment else { return None };
        self.height = usize::from(u16::from_be_bytes([h1, h0]));
        self.width = usize::from(u16::from_be_bytes([w1, w0]));
        self.components = components
            .chunks_exact(3)
            .take(usize::from(count))
            .map(|c| Component {
                id: c[0],
                horizontal: usize::from(c[1] >> 4),
                vertical: usize::from(c[1] & 15),
                seen: false,
            })
            .collect();
        let fits = |factor: usize| (1..=4).contains(&factor);
        (self.components.len() == usize::from(count)
            && (1..=4).contains(&count)
            && self.components.iter().all(|c| fits(c.horizontal) && fits(c.vertical)))
        .then_some(())
    }

    fn read_tables(&mut self, mut segment: &[u8]) -> Option<()> {
        while let [which, rest @ ..] = segment {
            let counts = rest.get(..16)?;
            let total = counts.iter().map(|&n| usize::from(n)).sum::<usize>();
            let values = rest.get(16..16 + total)?.to_vec();
            segment = &rest[16 + total..];
            let mut table = Table { max_code: [-1; 17], first: [0; 17], values };
            let (mut code, mut index) = (0, 0);
            for (length, &count) in (1..).zip(counts) {
                table.first[length] = index - code;
                code += i32::from(count);
                index += i32::from(count);
                if count > 0 {
                    table.max_code[length] = code - 1;
                }
                code <<= 1;
            }
            *self.tables.get_mut(usize::from(which >> 4))?.get_mut(usize::from(which & 15))? = Some(table);
        }
        Some(())
    }

    /// `Some(None)` when blocks are missing.
    fn walk_scan(&mut self, segment: &[u8], bits: &mut Bits<'_>) -> Option<Option<()>> {
        let (&count, selectors) = segment.split_first()?;
        let selectors: Vec<&[u8]> = selectors.chunks_exact(2).take(usize::from(count)).collect();
        if !(1..=4).contains(&selectors.len()) {
            return None;
        }
        let most = |f: fn(&Component) -> usize| self.components.iter().map(f).max();
        let (h_most, v_most) = (most(|c| c.horizontal)?, most(|c| c.vertical)?);
        // Of each unit: how many blocks by which tables.
        let mut blocks = Vec::new();
        let mut units = self.width.div_ceil(8 * h_most) * self.height.div_ceil(8 * v_most);
        for selector in &selectors {
            let component = self.components.iter_mut().find(|c| c.id == selector[0])?;
            component.seen = true;
            let mut number = component.horizontal * component.vertical;
            if selectors.len() == 1 {
                // Alone in a scan: block by block, without those beyond the image.
                let side = |pixels: usize, factor: usize, most: usize| (pixels * factor).div_ceil(most).div_ceil(8);
                units = side(self.width, component.horizontal, h_most) * side(self.height, component.vertical, v_most);
                number = 1;
            }
            blocks.push((number, usize::from(selector[1] >> 4), usize::from(selector[1] & 15)));
        }
        for unit in 0..units {
            if self.restart > 0 && unit > 0 && unit % self.restart == 0 && bits.restart().is_none() {
                return Some(None);
            }
            for &(number, dc, ac) in &blocks {
                let dc = self.tables[0].get(dc)?.as_ref()?;
                let ac = self.tables[1].get(ac)?.as_ref()?;
                for _ in 0..number {
                    if bits.skip_block(dc, ac).is_none() {
                        return Some(None);
                    }
                }
            }
        }
        Some(Some(()))
    }
}

/// The bits of a scan.
struct Bits<'a> {
    bytes: &'a [u8],
    held: u32,
    count: u32,
}

impl Bits<'_> {
    /// `None` where the scan ends.
    fn next(&mut self) -> Option<u32> {
        if self.count == 0 {
            let taken = match self.bytes {
                // A byte 0xff is followed by a zero.
                [0xff, 0, ..] => 2,
                [0xff, ..] | [] => return None,
                _ => 1,
            };
            self.held = u32::from(self.bytes[0]);
            self.bytes = &self.bytes[taken..];
            self.count = 8;
        }
        self.count -= 1;
        Some(self.held >> self.count & 1)
    }

    fn skip(&mut self, number: u8) -> Option<()> {
        (0..number).try_for_each(|_| self.next().map(|_| ()))
    }

    fn symbol(&mut self, table: &Table) -> Option<u8> {
        let mut code = 0;
        for length in 1..=16 {
            code = code << 1 | self.next()? as i32;
            if code <= table.max_code[length] {
                return table.values.get((table.first[length] + code) as usize).copied();
            }
        }
        None
    }

    fn skip_block(&mut self, dc: &Table, ac: &Table) -> Option<()> {
        let size = self.symbol(dc)?;
        self.skip(size)?;
        let mut k = 1;
        while k < 64 {
            let symbol = self.symbol(ac)?;
            match (symbol >> 4, symbol & 15) {
                (15, 0) => k += 16,
                (_, 0) => break,
                (run, size) => {
                    self.skip(size)?;
                    k += usize::from(run) + 1;
                }
            }
        }
        // More coefficients than a block has: no codes of this table.
        (k <= 64).then_some(())
    }

    /// The restart marker that has to be here.
    fn restart(&mut self) -> Option<()> {
        self.count = 0;
        while let [0xff, 0xff, ..] = self.bytes {
            self.bytes = &self.bytes[1..];
        }
        match self.bytes {
            [0xff, marker, rest @ ..] if RST.contains(marker) => {
                self.bytes = rest;
                Some(())
            }
            _ => None,
        }
    }
}
