//! A figure as a PNG image (ISO/IEC 15948).

use super::drawing::{Colour, Drawing, Outline, Point, Shape};
use std::ops::Range;

/// Pixels of the image per pixel shown: for displays and print of twice the resolution.
const PIXELS_PER_PIXEL: f64 = 2.0;
/// Scan lines per pixel: coverage has five levels down and is exact across.
const SUBLINES: usize = 4;
/// Sides of the polygons of circles and round ends.
const CIRCLE_SIDES: usize = 16;

/// The file.
pub(super) fn write(drawing: &Drawing) -> Vec<u8> {
    let image = Image::draw(drawing);
    let mut header = Vec::new();
    for length in [image.width, image.height] {
        header.extend((length as u32).to_be_bytes());
    }
    // Eight bits a channel, red, green and blue; one compression, one filter method, not interlaced.
    header.extend([8, 2, 0, 0, 0]);
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    for (name, data) in [(b"IHDR", header), (b"IDAT", compressed(&image.filtered())), (b"IEND", Vec::new())] {
        file.extend((data.len() as u32).to_be_bytes());
        let start = file.len();
        file.extend(name);
        file.extend(data);
        file.extend(crc32(&file[start..]).to_be_bytes());
    }
    file
}

/// Red, green and blue, row by row.
struct Image {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Image {
    fn draw(drawing: &Drawing) -> Self {
        let [width, height] =
            [drawing.shown.0, drawing.shown.1].map(|shown| (PIXELS_PER_PIXEL * shown).round().max(1.0) as usize);
        let mut image = Self { width, height, pixels: vec![255; 3 * width * height] };
        let scale = width as f64 / drawing.size.0;
        for shape in &drawing.shapes {
            if let Some(colour) = shape.fill {
                image.fill(&filled(shape, scale), colour, shape.opacity);
            }
            if let Some((colour, line_width)) = shape.stroke {
                image.fill(&stroked(shape, scale, 0.5 * line_width * scale), colour, shape.opacity);
            }
        }
        image
    }

    /// Fill polygons, which may overlap, by the nonzero rule.
    fn fill(&mut self, polygons: &[Vec<Point>], colour: Colour, opacity: f64) {
        let pixels = |along: fn(&Point) -> f64, length: usize| {
            let (low, high) = (polygons.iter().flatten().map(along))
                .fold((f64::MAX, 0.0_f64), |(low, high), at| (low.min(at.floor()), high.max(at.ceil())));
            let first = (low.max(0.0) as usize).min(length);
            first..(high as usize).clamp(first, length)
        };
        let Range { start: first, end } = pixels(|&(_, y)| y, self.height);
        let columns = pixels(|&(x, _)| x, self.width);
        let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); (end - first) * SUBLINES];
        // Number of the first scan line at or below a height.
        let last = crossings.len() as f64;
        let line = |y: f64| ((y - first as f64) * SUBLINES as f64 - 0.5).ceil().clamp(0.0, last) as usize;
        for polygon in polygons {
            for (&(x0, y0), &(x1, y1)) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
                let (top, bottom, direction) = if y0 < y1 { (y0, y1, 1) } else { (y1, y0, -1) };
                for (row, crossings) in crossings.iter_mut().enumerate().take(line(bottom)).skip(line(top)) {
                    let y = first as f64 + (row as f64 + 0.5) / SUBLINES as f64;
                    crossings.push((x0 + (x1 - x0) * (y - y0) / (y1 - y0), direction));
                }
            }
        }
        let mut coverage = vec![0.0; self.width];
        for (row, lines) in (first..).zip(crossings.chunks_mut(SUBLINES)) {
            if lines.iter().all(Vec::is_empty) {
                continue;
            }
            coverage[columns.clone()].fill(0.0);
            for line in lines {
                line.sort_by(|one, other| one.0.total_cmp(&other.0));
                let (mut winding, mut from) = (0, 0.0);
                for &(x, direction) in line.iter() {
                    if winding == 0 {
                        from = x;
                    }
                    winding += direction;
                    if winding == 0 {
                        cover(&mut coverage, from, x);
                    }
                }
            }
            let pixels = self.pixels[3 * (row * self.width + columns.start)..].chunks_exact_mut(3);
            for (pixel, covered) in pixels.zip(&coverage[columns.clone()]).filter(|(_, covered)| **covered > 0.0) {
                let share = opacity * covered / SUBLINES as f64;
                for (channel, ink) in pixel.iter_mut().zip(colour) {
                    *channel = (f64::from(*channel) + share * (f64::from(ink) - f64::from(*channel))).round() as u8;
                }
            }
        }
    }

    /// Rows with the filter "up": a row like the one above becomes zeros.
    fn filtered(&self) -> Vec<u8> {
        const UP: u8 = 2;
        let mut rows = Vec::with_capacity(self.pixels.len() + self.height);
        let mut above = vec![0; 3 * self.width];
        for row in self.pixels.chunks_exact(3 * self.width) {
            rows.push(UP);
            rows.extend(row.iter().zip(&above).map(|(here, above): (&u8, &u8)| here.wrapping_sub(*above)));
            above.copy_from_slice(row);
        }
        rows
    }
}

/// Add the share of every pixel between two places of a line.
fn cover(coverage: &mut [f64], from: f64, to: f64) {
    let (from, to) = (from.max(0.0), to.min(coverage.len() as f64));
    if to <= from {
        return;
    }
    for (pixel, covered) in coverage.iter_mut().enumerate().take(to.ceil() as usize).skip(from as usize) {
        let left = pixel as f64;
        *covered += (to.min(left + 1.0) - from.max(left)).max(0.0);
    }
}

/// The polygons of a filled shape, in pixels.
fn filled(shape: &Shape, scale: f64) -> Vec<Vec<Point>> {
    match &shape.outline {
        Outline::Path { subpaths, .. } => subpaths.iter().map(|points| scaled(points, scale)).collect(),
        Outline::Circle { centre, radius } => vec![disc((scale * centre.0, scale * centre.1), scale * radius)],
    }
}

/// The polygons that a line of a half width covers, with round ends and corners, all of one orientation.
fn stroked(shape: &Shape, scale: f64, half: f64) -> Vec<Vec<Point>> {
    let (runs, is_closed) = match &shape.outline {
        Outline::Path { subpaths, is_closed } => {
            (subpaths.iter().map(|points| scaled(points, scale)).collect(), *is_closed)
        }
        Outline::Circle { centre, radius } => (vec![disc((scale * centre.0, scale * centre.1), scale * radius)], true),
    };
    let mut polygons = Vec::new();
    for mut run in runs {
        if let (true, Some(&first)) = (is_closed, run.first()) {
            run.push(first);
        }
        polygons.extend(run.iter().map(|&point| disc(point, half)));
        polygons.extend(run.windows(2).filter_map(|pair| {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            let length = (x1 - x0).hypot(y1 - y0);
            let (across, down) = (half * (y1 - y0) / length, half * (x1 - x0) / length);
            let corners = [(x0 + across, y0 - down), (x1 + across, y1 - down), (x1 - across, y1 + down)];
            (length > 0.0).then(|| corners.into_iter().chain([(x0 - across, y0 + down)]).collect())
        }));
    }
    polygons
}

fn scaled(points: &[Point], scale: f64) -> Vec<Point> {
    points.iter().map(|(x, y)| (scale * x, scale * y)).collect()
}

fn disc((x, y): Point, radius: f64) -> Vec<Point> {
    let side = |side: usize| {
        let (sine, cosine) = (std::f64::consts::TAU * side as f64 / CIRCLE_SIDES as f64).sin_cos();
        (x + radius * cosine, y + radius * sine)
    };
    (0..CIRCLE_SIDES).map(side).collect()
}

/// A zlib stream of one block with the fixed codes of DEFLATE (RFC 1951), in which runs of one byte are matches at the
/// distance one: most of a filtered figure is zeros.
fn compressed(data: &[u8]) -> Vec<u8> {
    const LONGEST: usize = 258;
    const SHORTEST: usize = 3;
    let mut bits = Bits { bytes: vec![0x78, 0x01], pending: 0, count: 0 };
    bits.add(0b011, 3);
    let mut at = 0;
    while at < data.len() {
        bits.literal(data[at]);
        let mut run = data[at + 1..].iter().take_while(|byte| **byte == data[at]).count();
        at += 1 + run;
        while run >= SHORTEST {
            // Lengths 3 to 10 and 258 have codes without further bits.
            let length = if run >= LONGEST { LONGEST } else { run.min(10) };
            match length {
                LONGEST => bits.code(0b1100_0101, 8),
                _ => bits.code((length - SHORTEST + 1) as u32, 7),
            }
            bits.code(0, 5);
            run -= length;
        }
        (0..run).for_each(|_| bits.literal(data[at - 1]));
    }
    bits.code(0, 7);
    bits.add(0, 7);
    let mut stream = bits.bytes;
    stream.extend(adler32(data).to_be_bytes());
    stream
}

/// Bits of a DEFLATE stream, the lowest of a byte first.
struct Bits {
    bytes: Vec<u8>,
    pending: u32,
    count: u32,
}

impl Bits {
    fn add(&mut self, value: u32, bits: u32) {
        self.pending |= value << self.count;
        self.count += bits;
        while self.count >= 8 {
            self.bytes.push(self.pending as u8);
            (self.pending, self.count) = (self.pending >> 8, self.count - 8);
        }
    }

    /// A Huffman code, whose highest bit comes first.
    fn code(&mut self, code: u32, bits: u32) {
        self.add(code.reverse_bits() >> (32 - bits), bits);
    }

    fn literal(&mut self, byte: u8) {
        let value = u32::from(byte);
        if byte < 144 { self.code(0x30 + value, 8) } else { self.code(0x190 + value - 144, 9) }
    }
}

fn adler32(data: &[u8]) -> u32 {
    const MODULUS: u32 = 65_521;
    let (low, high) = data.iter().fold((1, 0), |(low, high), byte| {
        let low = (low + u32::from(*byte)) % MODULUS;
        (low, (high + low) % MODULUS)
    });
    high << 16 | low
}

fn crc32(data: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
    !data.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}
