//! Figures as PDF and PNG, drawn from the shapes of their SVG: neither a font nor a library is needed.

mod drawing;
mod pdf;
mod png;

use drawing::Drawing;

/// A format of figures beside SVG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// Vector graphics of one page.
    Pdf,
    /// Pixels, twice as many in each direction as the SVG has.
    Png,
}

impl FigureFormat {
    /// The ending of a file: `pdf` or `png`.
    pub(super) fn ending(self) -> &'static str {
        match self {
            Self::Pdf => "pdf",
            Self::Png => "png",
        }
    }

    /// The file of a figure, from its SVG.
    pub(super) fn file(self, svg: &str) -> Vec<u8> {
        let drawing = Drawing::read(svg);
        match self {
            Self::Pdf => pdf::write(&drawing),
            Self::Png => png::write(&drawing),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{figures, fixture, svg};

    /// Bits of a DEFLATE stream.
    struct Bits<'a> {
        bytes: &'a [u8],
        at: usize,
    }

    impl Bits<'_> {
        fn bit(&mut self) -> u32 {
            let bit = u32::from(self.bytes[self.at / 8] >> (self.at % 8) & 1);
            self.at += 1;
            bit
        }

        fn code(&mut self, bits: u32) -> u32 {
            (0..bits).fold(0, |code, _| code << 1 | self.bit())
        }

        /// A literal, the end of the block or a length, by the table of fixed codes in RFC 1951, 3.2.6.
        fn symbol(&mut self) -> u32 {
            let short = self.code(7);
            if short < 0b001_1000 {
                return 256 + short;
            }
            let code = short << 1 | self.bit();
            match code {
                0x30..0xC0 => code - 0x30,
                0xC0..0xC8 => 280 + code - 0xC0,
                _ => 144 + (code << 1 | self.bit()) - 0x190,
            }
        }
    }

    /// Width, height and pixels of a PNG of one block with fixed codes and the filter "up".
    fn decoded(png: &[u8]) -> (usize, usize, Vec<u8>) {
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
        let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes")) as usize;
        let (width, height) = (number(16), number(20));
        // Signature 8, IHDR 25, then length and name of IDAT, then the head of zlib.
        let mut bits = Bits { bytes: &png[8 + 25 + 8 + 2..], at: 0 };
        assert_eq!((bits.bit(), bits.bit(), bits.bit()), (1, 1, 0), "the last block, with fixed codes");
        let mut data: Vec<u8> = Vec::new();
        loop {
            let symbol = bits.symbol();
            let run = match symbol {
                0..256 => {
                    data.push(symbol as u8);
                    continue;
                }
                256 => break,
                257..265 => symbol - 254,
                285 => 258,
                _ => panic!("a length with further bits: {symbol}"),
            };
            assert_eq!(bits.code(5), 0, "a distance of one");
            let last = *data.last().expect("a byte before a run");
            data.extend((0..run).map(|_| last));
        }
        let mut above = vec![0_u8; 3 * width];
        let mut pixels = Vec::with_capacity(3 * width * height);
        for row in data.chunks_exact(1 + 3 * width) {
            assert_eq!(row[0], 2, "the filter up");
            above.iter_mut().zip(&row[1..]).for_each(|(pixel, change)| *pixel = pixel.wrapping_add(*change));
            pixels.extend_from_slice(&above);
        }
        (width, height, pixels)
    }

    /// Share of the pixels that are not white.
    fn inked(pixels: &[u8]) -> f64 {
        let inked = pixels.chunks_exact(3).filter(|pixel| **pixel != [255, 255, 255]).count();
        3.0 * inked as f64 / pixels.len() as f64
    }

    /// Every third figure, as there are many.
    #[test]
    fn a_png_decodes_to_the_size_of_its_figure_and_is_not_blank() {
        let all = figures::all(&fixture::outcomes().answers("study"));
        for figure in all.iter().step_by(3) {
            let svg = svg::draw(figure).expect("it draws");
            let (width, height, pixels) = decoded(&FigureFormat::Png.file(&svg));
            assert_eq!((width, height, pixels.len()), (1800, 1040, 3 * 1800 * 1040), "{}", figure.id);
            assert!((0.005..0.9).contains(&inked(&pixels)), "{}: {} of the pixels", figure.id, inked(&pixels));
        }
        let blank = "<svg width=\"90\" height=\"52\" viewBox=\"0 0 360 208\">\n</svg>\n";
        assert_eq!(inked(&decoded(&FigureFormat::Png.file(blank)).2), 0.0);
    }

    #[test]
    fn a_filled_shape_has_its_colour_at_its_place_and_half_of_it_where_it_is_translucent() {
        let svg = "<svg width=\"90\" height=\"52\" viewBox=\"0 0 360 208\">\n\
            <rect x=\"40\" y=\"40\" width=\"80\" height=\"80\" fill=\"#C80000\" stroke=\"none\"/>\n\
            <rect x=\"200\" y=\"40\" width=\"80\" height=\"80\" opacity=\"0.5\" fill=\"#000000\" stroke=\"none\"/>\n\
            </svg>\n";
        let (width, _, pixels) = decoded(&FigureFormat::Png.file(svg));
        let pixel = |x: usize, y: usize| pixels[3 * (y * width + x)..][..3].to_vec();
        assert_eq!([pixel(10, 40), pixel(40, 40), pixel(120, 40)], [[255; 3], [200, 0, 0], [128; 3]]);
        assert!((inked(&pixels) - 2.0 * 40.0 * 40.0 / (180.0 * 104.0)).abs() < 1e-9);
    }

    #[test]
    fn of_a_shape_only_the_part_within_the_image_is_painted() {
        let shape = |[x, y]: [i32; 2]| {
            format!("<rect x=\"{x}\" y=\"{y}\" width=\"80\" height=\"40\" fill=\"#C80000\" stroke=\"none\"/>\n")
        };
        let inked_at = |places: &[[i32; 2]]| {
            let shapes: String = places.iter().map(|place| shape(*place)).collect();
            let svg = format!("<svg width=\"90\" height=\"52\" viewBox=\"0 0 360 208\">\n{shapes}</svg>\n");
            (inked(&decoded(&FigureFormat::Png.file(&svg)).2) * 180.0 * 104.0).round()
        };
        // Two units are a pixel: past the left side, the top, and the corner at the bottom right.
        assert_eq!(inked_at(&[[-20, 80], [140, -10], [340, 198]]), 30.0 * 20.0 + 40.0 * 15.0 + 10.0 * 5.0);
        assert_eq!(inked_at(&[[-80, 80], [360, 80], [140, -40], [140, 208]]), 0.0);
    }

    #[test]
    fn a_pdf_has_its_objects_where_its_table_says_and_paints_many_shapes() {
        for figure in figures::all(&fixture::outcomes().answers("study")) {
            let file = FigureFormat::Pdf.file(&svg::draw(&figure).expect("it draws"));
            let text = String::from_utf8(file).expect("ASCII");
            assert!(text.starts_with("%PDF-1.4\n") && text.ends_with("\n%%EOF\n"));
            let (_, start) = text.rsplit_once("startxref\n").expect("a start");
            let start: usize = start.lines().next().expect("a number").parse().expect("a number");
            let entries = text[start..].lines().skip(3).take(4).enumerate();
            for (index, entry) in entries {
                let offset: usize = entry[..10].parse().expect("an offset");
                assert!(text[offset..].starts_with(&format!("{} 0 obj\n", index + 1)), "{}", figure.id);
            }
            let (before, content) = text.split_once("stream\n").expect("a stream");
            let length = before.rsplit_once("/Length ").and_then(|(_, rest)| rest.split(' ').next()).expect("a length");
            assert!(content[length.parse::<usize>().expect("a number")..].starts_with("endstream"), "{}", figure.id);
            let painted = content.lines().filter(|line| ["f", "S", "B"].contains(line)).count();
            assert!(painted > 10 && !content.contains("NaN"), "{}: {painted} shapes", figure.id);
        }
    }
}
