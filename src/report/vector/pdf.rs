//! A figure as a PDF of one page with vector graphics (ISO 32000-1).

use super::drawing::{Colour, Drawing, Outline, Point, Shape};
use std::fmt::Write as _;

/// Points per pixel of CSS.
const POINTS_PER_PIXEL: f64 = 0.75;
/// Distance of the control points of the Bézier curves of a quarter circle, in radii.
const CIRCLE_CONTROL: f64 = 0.552_284_75;

/// The file.
pub(super) fn write(drawing: &Drawing) -> Vec<u8> {
    let [width, height] = [drawing.shown.0, drawing.shown.1].map(|pixels| POINTS_PER_PIXEL * pixels);
    let [across, down] = [width / drawing.size.0, height / drawing.size.1];
    let mut opacities: Vec<f64> = drawing.shapes.iter().map(|shape| shape.opacity).collect();
    opacities.sort_by(f64::total_cmp);
    opacities.dedup();
    // Round ends and corners; the origin of the drawing is above, that of a page below.
    let mut content = format!("1 J 1 j {across:.6} 0 0 {:.6} 0 {height} cm\n", -down);
    for shape in &drawing.shapes {
        let state = opacities.iter().position(|opacity| *opacity == shape.opacity).unwrap_or_default();
        let _ = writeln!(content, "/G{state} gs");
        add(&mut content, shape);
    }
    let states: String = opacities
        .iter()
        .enumerate()
        .map(|(state, opacity)| format!("/G{state} << /ca {opacity} /CA {opacity} >> "))
        .collect();
    let objects = [
        "<< /Type /Catalog /Pages 2 0 R >>".to_owned(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width} {height}] /Contents 4 0 R /Resources << /ExtGState << \
             {states}>> >> >>"
        ),
        format!("<< /Length {} >>\nstream\n{content}endstream", content.len()),
    ];
    let mut file = "%PDF-1.4\n".to_owned();
    let mut offsets = Vec::with_capacity(objects.len());
    for (index, object) in objects.iter().enumerate() {
        offsets.push(file.len());
        let _ = write!(file, "{} 0 obj\n{object}\nendobj\n", index + 1);
    }
    let (start, entries) = (file.len(), objects.len() + 1);
    let _ = write!(file, "xref\n0 {entries}\n0000000000 65535 f \n");
    for offset in offsets {
        let _ = writeln!(file, "{offset:010} 00000 n ");
    }
    let _ = write!(file, "trailer\n<< /Size {entries} /Root 1 0 R >>\nstartxref\n{start}\n%%EOF\n");
    file.into_bytes()
}

fn add(content: &mut String, shape: &Shape) {
    let [fill, stroke] = [(shape.fill, "rg"), (shape.stroke.map(|(colour, _)| colour), "RG")];
    for (colour, operator) in [fill, stroke] {
        if let Some(colour) = colour {
            let _ = writeln!(content, "{} {operator}", channels(colour));
        }
    }
    if let Some((_, width)) = shape.stroke {
        let _ = writeln!(content, "{width:.2} w");
    }
    match &shape.outline {
        Outline::Path { subpaths, is_closed } => {
            for points in subpaths {
                for (place, (x, y)) in points.iter().enumerate() {
                    let _ = write!(content, "{x:.1} {y:.1} {} ", if place == 0 { "m" } else { "l" });
                }
                content.push_str(if *is_closed { "h\n" } else { "\n" });
            }
        }
        Outline::Circle { centre, radius } => circle(content, *centre, *radius),
    }
    content.push_str(match (shape.fill, shape.stroke) {
        (Some(_), Some(_)) => "B\n",
        (Some(_), None) => "f\n",
        (None, Some(_)) => "S\n",
        (None, None) => "n\n",
    });
}

fn channels(colour: Colour) -> String {
    colour.map(|channel| format!("{:.3}", f64::from(channel) / 255.0)).join(" ")
}

fn circle(content: &mut String, (x, y): Point, radius: f64) {
    let control = CIRCLE_CONTROL * radius;
    let _ = write!(content, "{:.1} {y:.1} m ", x + radius);
    // A quarter from (a, b) to (-b, a) about the centre.
    for (a, b) in [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)] {
        let at = |along: f64, turned: f64| (x + along * a - turned * b, y + along * b + turned * a);
        for (x, y) in [at(radius, control), at(control, radius), at(0.0, radius)] {
            let _ = write!(content, "{x:.1} {y:.1} ");
        }
        content.push_str("c ");
    }
    content.push_str("h\n");
}
