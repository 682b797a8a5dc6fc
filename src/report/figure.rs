//! One description of a figure, from which both the static image (`svg`) and the interactive chart (`chart`) are drawn.

/// A figure and its caption.
#[derive(Clone, Debug)]
pub(super) struct Figure {
    /// Name of its file, without the extension.
    pub id: String,
    pub title: String,
    /// Caption: the result first, then the explanation of lines and colours.
    pub caption: String,
    pub x: Axis,
    pub y: Axis,
    /// Drawn in this order.
    pub layers: Vec<Layer>,
}

/// One axis.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// Quantity and unit, such as `Time, s`.
    pub label: String,
    pub scale: Scale,
    /// Lowest and highest value shown; `None` for all values.
    pub range: Option<(f64, f64)>,
}

/// How an axis maps its values.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Scale {
    Linear,
    Log,
    /// Integers, such as iterations.
    Integer,
    /// The value is an index into these names.
    Categories(Vec<String>),
}

/// One plotted series. A layer without a name has no legend entry. NaN is a gap.
#[derive(Clone, Debug)]
pub(super) enum Layer {
    Line {
        name: String,
        ink: Ink,
        stroke: Stroke,
        x: Vec<f64>,
        y: Vec<f64>,
    },
    /// Markers, with error bars of half-length `error` unless it is empty.
    Points {
        name: String,
        ink: Ink,
        x: Vec<f64>,
        y: Vec<f64>,
        error: Vec<f64>,
    },
    /// The area between two curves.
    Band {
        name: String,
        ink: Ink,
        opacity: f64,
        x: Vec<f64>,
        low: Vec<f64>,
        high: Vec<f64>,
    },
    /// Stacked areas, the first at the bottom, in per cent.
    StackedAreas {
        x: Vec<f64>,
        parts: Vec<StackedArea>,
    },
    /// An interval of the horizontal axis.
    Interval {
        name: String,
        from: f64,
        to: f64,
    },
    /// A matrix of correlations in -1..1, row by row from the top; both axes have names.
    Heatmap {
        values: Vec<Vec<f64>>,
    },
    /// Contour lines of a positive function, `values[j][i]` at `x[j][i]`, `y[j][i]`.
    Contours {
        name: String,
        x: Vec<Vec<f64>>,
        y: Vec<Vec<f64>>,
        values: Vec<Vec<f64>>,
        /// Ascending, with equal ratios.
        levels: Vec<f64>,
    },
    /// A corner plot: marginal histograms on the diagonal, density regions of each pair below it. It fills the figure
    /// and has its own axes.
    CornerPlot {
        variables: Vec<CornerVariable>,
        regions: Vec<DensityRegion>,
    },
    /// Layers of which one step is shown at a time: a chart has a slider, a static image shows the step `shown`.
    Steps {
        /// Before the name of the step.
        label: String,
        names: Vec<String>,
        steps: Vec<Vec<Self>>,
        shown: usize,
    },
    /// Box plots: percentiles 2.5, 25, 50, 75, 97.5 at each name of the horizontal axis.
    BoxPlot {
        name: String,
        ink: Ink,
        percentiles: Vec<[f64; 5]>,
    },
}

/// One variable of a corner plot.
#[derive(Clone, Debug)]
pub(super) struct CornerVariable {
    pub name: String,
    /// Lowest and highest value shown.
    pub range: (f64, f64),
    /// Centres of the histogram bins and the share of samples in each.
    pub bin_centres: Vec<f64>,
    pub shares: Vec<f64>,
    pub estimate: f64,
    /// 95 % interval.
    pub interval: (f64, f64),
}

/// One panel of a corner plot; `across` and `up` are indices of its variables.
#[derive(Clone, Debug)]
pub(super) struct DensityRegion {
    pub across: usize,
    pub up: usize,
    /// `enclosed[j][i]` at bin centres i across and j up: probability of the region of at least this density.
    pub enclosed: Vec<Vec<f64>>,
}

/// One of several stacked areas.
#[derive(Clone, Debug)]
pub(super) struct StackedArea {
    pub name: String,
    pub ink: Ink,
    pub values: Vec<f64>,
}

/// A colour by its role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ink {
    /// The n-th of a series, such as sensors or factors.
    Series(usize),
    /// Measurements.
    Measured,
    /// References and guides.
    Guide,
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stroke {
    Solid,
    Dashed,
    Dotted,
    /// Dashed, at half the width of the others.
    Thin,
    /// Solid, at half the width of the others: for many lines.
    Hairline,
}

/// Red, green, blue.
pub(super) type Colour = (u8, u8, u8);

/// Minimum and maximum; `None` of no values.
pub(super) type Span = Option<(f64, f64)>;

/// Colours of Okabe and Ito (Color Universal Design, 2008) without yellow, which has too little contrast on white, then
/// those of Tol's muted scheme (SRON/EPS/TN/09-002, 2021) that colour-blind readers can distinguish from them.
const PALETTE: [Colour; 10] = [
    (0x00, 0x72, 0xB2),
    (0xD5, 0x5E, 0x00),
    (0x00, 0x9E, 0x73),
    (0xCC, 0x79, 0xA7),
    (0xE6, 0x9F, 0x00),
    (0x56, 0xB4, 0xE9),
    (0x33, 0x22, 0x88),
    (0x88, 0x22, 0x55),
    (0x99, 0x99, 0x33),
    (0x66, 0x66, 0x66),
];

impl Stroke {
    /// Pixels.
    pub(super) fn width(self) -> u32 {
        if matches!(self, Self::Thin | Self::Hairline) { 1 } else { 2 }
    }
}

impl Ink {
    pub(super) fn rgb(self) -> Colour {
        match self {
            Self::Series(index) => PALETTE[index % PALETTE.len()],
            Self::Measured => (0x22, 0x22, 0x22),
            Self::Guide => (0x77, 0x77, 0x77),
        }
    }
}

/// Colour of a correlation: blue for -1, white for 0, vermilion for 1.
pub(super) fn diverging_colour(correlation: f64) -> Colour {
    let (from, t) = if correlation < 0.0 { (PALETTE[0], -correlation) } else { (PALETTE[1], correlation) };
    interpolate_colour((255, 255, 255), from, t.min(1.0))
}

/// Colour of a level, `t` in 0..1 from the lowest (dark blue) to the highest (ochre).
pub(super) fn sequential_colour(t: f64) -> Colour {
    const STOPS: [Colour; 4] = [(0x33, 0x22, 0x88), (0x00, 0x72, 0xB2), (0x00, 0x9E, 0x73), (0xC9, 0x8B, 0x00)];
    let place = t.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (place as usize).min(STOPS.len() - 2);
    interpolate_colour(STOPS[below], STOPS[below + 1], place - below as f64)
}

fn interpolate_colour(from: Colour, to: Colour, t: f64) -> Colour {
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * t).round() as u8;
    (mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

impl Axis {
    pub(super) fn linear(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Linear, range: None }
    }

    pub(super) fn log(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Log, range: None }
    }

    pub(super) fn integer(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Integer, range: None }
    }

    pub(super) fn categories(label: &str, names: Vec<String>) -> Self {
        let range = Some((-0.5, names.len() as f64 - 0.5));
        Self { label: label.to_owned(), scale: Scale::Categories(names), range }
    }

    pub(super) fn with_range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }
}

impl Layer {
    /// Minimum and maximum finite value along each axis; `None` where there is none.
    pub(super) fn extent(&self) -> (Span, Span) {
        match self {
            Self::Line { x, y, .. } => (span(x), span(y)),
            Self::Points { x, y, error, .. } => {
                let low = y.iter().enumerate().map(|(i, y)| y - error.get(i).copied().unwrap_or(0.0));
                let high = y.iter().enumerate().map(|(i, y)| y + error.get(i).copied().unwrap_or(0.0));
                (span(x), span(&low.chain(high).collect::<Vec<f64>>()))
            }
            Self::Band { x, low, high, .. } => (span(x), union(span(low), span(high))),
            Self::StackedAreas { x, .. } => (span(x), Some((0.0, 100.0))),
            Self::Interval { .. } | Self::Heatmap { .. } | Self::CornerPlot { .. } => (None, None),
            Self::Contours { x, y, .. } => (span(&x.concat()), span(&y.concat())),
            Self::Steps { steps, .. } => steps.iter().flatten().fold((None, None), |(x, y), layer| {
                let (across, up) = layer.extent();
                (union(x, across), union(y, up))
            }),
            Self::BoxPlot { percentiles, .. } => (None, span(percentiles.as_flattened())),
        }
    }
}

impl Figure {
    /// Range of each axis: its own, else that of all layers; never empty.
    pub(super) fn extent(&self) -> ((f64, f64), (f64, f64)) {
        let (mut x, mut y) = (None, None);
        for layer in &self.layers {
            let (across, up) = layer.extent();
            x = union(x, across);
            y = union(y, up);
        }
        (self.x.range.or(x).unwrap_or((0.0, 1.0)), self.y.range.or(y).unwrap_or((0.0, 1.0)))
    }
}

fn span(values: &[f64]) -> Span {
    values.iter().filter(|value| value.is_finite()).fold(None, |reach, &value| union(reach, Some((value, value))))
}

fn union(a: Span, b: Span) -> Span {
    match (a, b) {
        (Some(a), Some(b)) => Some((a.0.min(b.0), a.1.max(b.1))),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extent_of_points_includes_error_bars_and_ignores_nan() {
        let points = Layer::Points {
            name: String::new(),
            ink: Ink::Measured,
            x: vec![0.0, 1.0, 2.0],
            y: vec![300.0, f64::NAN, 400.0],
            error: vec![4.0, 4.0, 4.0],
        };
        assert_eq!(points.extent(), (Some((0.0, 2.0)), Some((296.0, 404.0))));
    }

    #[test]
    fn the_ten_first_series_have_ten_colours() {
        let mut colours: Vec<_> = (0..10).map(|n| Ink::Series(n).rgb()).collect();
        colours.sort_unstable();
        colours.dedup();
        assert_eq!(colours.len(), 10);
    }

    #[test]
    fn opposite_correlations_have_different_colours_and_zero_is_white() {
        assert_eq!(diverging_colour(0.0), (255, 255, 255));
        assert_ne!(diverging_colour(-1.0), diverging_colour(1.0));
        assert_eq!(diverging_colour(-2.0), diverging_colour(-1.0));
    }
}
