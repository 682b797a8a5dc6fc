//! The objective over two factors: the paper's design space.
//!
//! S is not interpolated, because it may rise a thousandfold across a valley within a hundredth of the bounds, and an
//! interpolant between a few nodes has false minima. The residuals are smooth, so they are interpolated by cubic
//! Hermite polynomials through values and derivatives at the nodes (de Boor, *A Practical Guide to Splines*, 1978), and
//! S is computed from them.
//!
//! A rectangular plotting grid also has false minima, because a valley at an angle passes near some grid points and far
//! from others. So the map is evaluated on lines of constant factor, and each line has a node at its minimum. These
//! nodes follow the valley and contain exactly the minima of S.

use crate::fit::{LeastSquares, Prior, RobustLoss, Tangent, finite_difference_tangent};
use crate::march::MarchError;
use crate::study::thermocouple_residuals::ThermocoupleResiduals;
use nalgebra::{DMatrix, DVector};

/// The objective over two factors, line × node; one of the two factors is constant on each line.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Landscape {
    /// Values of the first factor, line × node.
    pub x: Vec<Vec<f64>>,
    /// Values of the second factor, line × node.
    pub y: Vec<Vec<f64>>,
    /// The objective S; NaN where members failed.
    pub objective: Vec<Vec<f64>>,
    /// Index of the node at the minimum of each line.
    pub valley: usize,
}

/// The objective as a function of the standardised residuals.
pub(super) struct Objective<'a> {
    pub loss: RobustLoss,
    /// Weight of the data residuals.
    pub weight: f64,
    pub priors: &'a [Prior],
}

/// Nodes along each factor at which members are marched.
pub const NODES: usize = 13;
/// Lines of the map per node spacing.
const LINES_PER_INTERVAL: usize = 8;
/// Points per node spacing in the search for the minimum of a line, before golden section.
const PROBES_PER_INTERVAL: usize = 8;
/// Nodes on each side of the minimum of a line.
const NODES_PER_SIDE: usize = 32;
/// Golden-section steps; further steps do not change S.
const GOLDEN_STEPS: usize = 60;

impl Objective<'_> {
    /// The landscape of two factors between their bounds; `None` for another number of factors or empty bounds. Lines
    /// run along the factor with the larger effect at the estimate, so that each crosses the valley. `step` is the
    /// finite-difference step where the march computes no derivatives.
    pub(super) fn landscape(
        &self,
        problem: &mut ThermocoupleResiduals,
        bounds: &[(f64, f64)],
        at_estimate: &DMatrix<f64>,
        step: f64,
    ) -> Result<Option<Landscape>, MarchError> {
        let &[first, second] = bounds else { return Ok(None) };
        if first.0 >= first.1 || second.0 >= second.1 {
            return Ok(None);
        }
        let effect = |factor: usize| at_estimate.column(factor).norm() * (bounds[factor].1 - bounds[factor].0);
        // Index of the factor that is constant on a line.
        let held = usize::from(effect(1) < effect(0));
        let axes = Axes { held, along: bounds[held], across: bounds[1 - held] };
        let mut map = Landscape { x: Vec::new(), y: Vec::new(), objective: Vec::new(), valley: NODES_PER_SIDE };
        let mut before = self.nodes(problem, &axes, 0, step)?;
        for next in 1..NODES {
            let after = self.nodes(problem, &axes, next, step)?;
            let lines = if next + 1 == NODES { 0..=LINES_PER_INTERVAL } else { 0..=LINES_PER_INTERVAL - 1 };
            for share in lines.map(|line| line as f64 / LINES_PER_INTERVAL as f64) {
                let value = axes.along.0 + axes.spacing(axes.along) * ((next - 1) as f64 + share);
                let value = if next + 1 == NODES && share == 1.0 { axes.along.1 } else { value };
                let line = Line::between(&before, &after, share, &axes);
                self.add_line(&mut map, &axes, value, &line);
            }
            before = after;
        }
        Ok(Some(map))
    }

    /// March a row of nodes with one factor constant. Rows are marched one at a time, so that only two are in memory.
    fn nodes(
        &self,
        problem: &mut ThermocoupleResiduals,
        axes: &Axes,
        row: usize,
        step: f64,
    ) -> Result<Vec<Tangent>, MarchError> {
        let at = |(low, high): (f64, f64), node: usize| low + (high - low) * node as f64 / (NODES - 1) as f64;
        let columns: Vec<DVector<f64>> = (0..NODES)
            .map(|node| {
                let mut point = DVector::zeros(2);
                point[axes.held] = at(axes.along, row);
                point[1 - axes.held] = at(axes.across, node);
                point
            })
            .collect();
        let tangents = match problem.tangents(&DMatrix::from_columns(&columns))? {
            Some(tangents) => tangents,
            None => {
                columns.iter().map(|point| finite_difference_tangent(problem, point, step)).collect::<Result<_, _>>()?
            }
        };
        // Column 0: the factor that is constant on lines; column 1: the factor along the lines.
        let turned = |mut tangent: Tangent| {
            if axes.held == 1 {
                tangent.jacobian.swap_columns(0, 1);
            }
            tangent
        };
        Ok(tangents.into_iter().map(turned).collect())
    }

    /// S on a line, at a position in units of the node spacing.
    fn objective(&self, axes: &Axes, value: f64, line: &Line, place: f64) -> f64 {
        let of_data: f64 = line.residuals(place, axes.spacing(axes.across)).map(|r| self.loss.rho(r)).sum();
        let across = axes.across.0 + axes.spacing(axes.across) * place;
        let of_prior = |prior: &Prior| prior.residual(if prior.variable == axes.held { value } else { across }).powi(2);
        self.weight.powi(2) * of_data + self.priors.iter().map(of_prior).sum::<f64>()
    }

    /// Add a line to the map, with nodes concentrated around its minimum.
    fn add_line(&self, map: &mut Landscape, axes: &Axes, value: f64, line: &Line) {
        let last = (NODES - 1) as f64;
        let objective = |place: f64| self.objective(axes, value, line, place);
        let least = line_minimum(&objective, last);
        let below = (0..NODES_PER_SIDE).map(|node| least * (1.0 - (1.0 - node as f64 / NODES_PER_SIDE as f64).powi(3)));
        let above =
            (1..=NODES_PER_SIDE).map(|node| least + (last - least) * (node as f64 / NODES_PER_SIDE as f64).powi(3));
        let places: Vec<f64> = below.chain([least]).chain(above).collect();
        map.objective.push(places.iter().map(|&place| objective(place)).collect());
        let (low, high) = axes.across;
        let across = places.iter().map(|place| low + (high - low) * (place / last)).collect();
        let along = vec![value; places.len()];
        let [x, y] = if axes.held == 0 { [along, across] } else { [across, along] };
        map.x.push(x);
        map.y.push(y);
    }
}

/// The axes of the map: one factor is constant on each line, the other varies.
struct Axes {
    /// Index of the factor that is constant on a line.
    held: usize,
    /// Bounds of the constant factor; its axis runs along the valley.
    along: (f64, f64),
    /// Bounds of the factor that varies on a line; its axis crosses the valley.
    across: (f64, f64),
}

impl Axes {
    fn spacing(&self, (low, high): (f64, f64)) -> f64 {
        (high - low) / (NODES - 1) as f64
    }
}

/// Residuals and their slopes along a line, residual × node.
struct Line {
    values: Vec<[f64; NODES]>,
    slopes: Vec<[f64; NODES]>,
}

impl Line {
    /// Interpolate between two rows of nodes at a fraction of their spacing.
    fn between(before: &[Tangent], after: &[Tangent], share: f64, axes: &Axes) -> Self {
        let [start, leaving, end, arriving] = hermite(share);
        let (spacing, spacing_across) = (axes.spacing(axes.along), axes.spacing(axes.across));
        let (leaving, arriving) = (spacing * leaving, spacing * arriving);
        let rows = before.first().map_or(0, |tangent| tangent.residuals.len());
        let blend = |of: &dyn Fn(&[Tangent], usize) -> f64, slope: &dyn Fn(&[Tangent], usize) -> f64| {
            std::array::from_fn(|node| {
                let ends = start * of(before, node) + end * of(after, node);
                ends + leaving * slope(before, node) + arriving * slope(after, node)
            })
        };
        let values =
            (0..rows).map(|i| blend(&|row, node| row[node].residuals[i], &|row, node| row[node].jacobian[(i, 0)]));
        let slopes = (0..rows).map(|i| {
            blend(&|row, node| row[node].jacobian[(i, 1)], &|row, node| mixed_derivative(row, node, i) / spacing_across)
        });
        Self { values: values.collect(), slopes: slopes.collect() }
    }

    /// All residuals at a position on the line; `spacing` is the node spacing.
    fn residuals(&self, place: f64, spacing: f64) -> impl Iterator<Item = f64> {
        let node = (place.max(0.0) as usize).min(NODES - 2);
        let [start, leaving, end, arriving] = hermite(place - node as f64);
        let at = move |(values, slopes): (&[f64; NODES], &[f64; NODES])| {
            let tilt = spacing * (leaving * slopes[node] + arriving * slopes[node + 1]);
            start * values[node] + end * values[node + 1] + tilt
        };
        self.values.iter().zip(&self.slopes).map(at)
    }
}

/// Cubic Hermite weights at a fraction of an interval: value and slope at the start, value and slope at the end.
fn hermite(t: f64) -> [f64; 4] {
    let (rest, bump) = (1.0 - t, t * (1.0 - t));
    [rest * rest * (1.0 + 2.0 * t), bump * rest, t * t * (3.0 - 2.0 * t), -bump * t]
}

/// Mixed second derivative of a residual, per node spacing along the row, by second-order differences of the exact
/// first derivatives. Its error in the interpolated residual is of fourth order in the spacing, like that of the
/// interpolation.
fn mixed_derivative(row: &[Tangent], node: usize, residual: usize) -> f64 {
    let slope = |node: usize| row[node].jacobian[(residual, 0)];
    let last = row.len() - 1;
    match node {
        0 => 0.5 * (4.0 * slope(1) - 3.0 * slope(0) - slope(2)),
        _ if node == last => 0.5 * (3.0 * slope(last) - 4.0 * slope(last - 1) + slope(last - 2)),
        _ => 0.5 * (slope(node + 1) - slope(node - 1)),
    }
}

/// Position of the minimum between zero and `last`: the lowest of evenly spaced probes, refined by golden
/// section.
fn line_minimum(objective: &dyn Fn(f64) -> f64, last: f64) -> f64 {
    let probes = PROBES_PER_INTERVAL * (NODES - 1);
    let place = |probe: usize| last * probe as f64 / probes as f64;
    let probed = (0..=probes).map(|probe| (probe, objective(place(probe)))).filter(|(_, s)| s.is_finite());
    let Some((probe, s)) = probed.min_by(|a, b| a.1.total_cmp(&b.1)) else { return 0.5 * last };
    let (mut low, mut high) = (place(probe.saturating_sub(1)), place((probe + 1).min(probes)));
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    for _ in 0..GOLDEN_STEPS {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if objective(a) < objective(b) { high = b } else { low = a }
    }
    // At a bound the end point is lower than any interior point.
    let found = [low, high, 0.5 * (low + high), place(probe)].map(|at| (at, objective(at)));
    found.into_iter().filter(|(_, s)| s.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((place(probe), s)).0
}

impl Landscape {
    /// Number of lines of a map.
    pub const LINES: usize = LINES_PER_INTERVAL * (NODES - 1) + 1;

    /// Local minima: nodes, or plateaus of equal nodes, without a lower neighbour on their own or the adjacent lines.
    pub fn minima(&self) -> Vec<(f64, f64)> {
        let at = |(line, node): (usize, usize)| self.objective[line][node];
        let mut seen: Vec<Vec<bool>> = self.objective.iter().map(|line| vec![false; line.len()]).collect();
        let mut minima = Vec::new();
        for (line, nodes) in self.objective.iter().enumerate() {
            for node in 0..nodes.len() {
                if seen[line][node] || !nodes[node].is_finite() {
                    continue;
                }
                seen[line][node] = true;
                let (mut level, mut is_least) = (vec![(line, node)], true);
                while let Some(place) = level.pop() {
                    for next in self.neighbours(place) {
                        is_least &= at(next).is_nan() || at(next) >= at(place);
                        if at(next) == at(place) && !seen[next.0][next.1] {
                            seen[next.0][next.1] = true;
                            level.push(next);
                        }
                    }
                }
                if is_least {
                    minima.push((self.x[line][node], self.y[line][node]));
                }
            }
        }
        minima
    }

    fn neighbours(&self, (line, node): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
        let lines = line.saturating_sub(1)..(line + 2).min(self.objective.len());
        let nodes = node.saturating_sub(1)..(node + 2).min(self.objective[line].len());
        lines
            .flat_map(move |line| nodes.clone().map(move |node| (line, node)))
            .filter(move |&next| next != (line, node))
    }
}
