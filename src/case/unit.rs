//! Parsing of quantities with units, `"26.7 W/cm^2"`, into SI with a check of the dimension.
//!
//! A unit is a sequence of factors joined by `/`, `*`, `·` or a space, evaluated from left to right, with parentheses
//! and powers (`cm^2`, `cm2` and `cm²` are equal). A hyphen multiplies on its side of the stroke, as in tables of
//! properties: `BTU/lb-degR` is `BTU/lb/degR`. Conversion factors are exact by definition (SI brochure, 9th edition;
//! NIST SP 811, appendix B, for inch, foot, pound, pound-force, degree Rankine, BTU (IT), calorie (thermochemical) and
//! torr), or products of such factors.

use crate::limits::LAYUP_TEMPERATURE_K;

/// Physical dimension and kind of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Dimension {
    /// m
    Length,
    /// s
    Time,
    /// K, on the absolute scale: `20 degC` is 293.15 K.
    Temperature,
    /// K, on the absolute scale, of a point of the layup: at most the end of all tables.
    LayupTemperature,
    /// K, on the absolute scale: radiative surroundings, possibly space at 0 K.
    Surroundings,
    /// K: `2 degC` is 2 K.
    TemperatureDifference,
    /// Pa
    Pressure,
    /// W/m²
    HeatFlux,
    /// W/m²/K: film, contact, holder.
    Conductance,
    /// m² K/W: contact.
    ContactResistance,
    /// kg/m²/s: film coefficient of an enthalpy difference.
    MassFlux,
    /// W/m³/K: lateral conductance to a holder.
    VolumeConductance,
    /// W/m/K
    Conductivity,
    /// J/kg
    SpecificEnthalpy,
    /// J/kg/K
    HeatCapacity,
    /// kg/m³
    Density,
    /// 1/m
    Extinction,
    /// m²/kg
    SpecificExtinction,
    /// m²
    Permeability,
    /// 1/m: Forchheimer's inertial coefficient.
    InertialCoefficient,
    /// 1/s
    Rate,
    /// J/mol
    MolarEnergy,
    /// kg/mol
    MolarMass,
    /// Pa s
    Viscosity,
    /// A plain number or a percentage.
    Fraction,
}

/// Exponents of kilogram, metre, second, kelvin and mole.
type Exponents = [i32; 5];

impl Dimension {
    /// Name and example for messages: `a heat flux such as "26.7 W/cm^2"`.
    pub fn name_and_example(self) -> &'static str {
        match self {
            Self::Length => "a length such as \"0.51 mm\"",
            Self::Time => "a time such as \"41 s\"",
            Self::Temperature | Self::LayupTemperature => "a temperature such as \"300 K\"",
            Self::Surroundings => "a temperature such as \"300 K\", or \"0 K\" for space",
            Self::TemperatureDifference => "a temperature difference such as \"2 K\"",
            Self::Pressure => "a pressure such as \"8.01 kPa\"",
            Self::HeatFlux => "a heat flux such as \"26.7 W/cm^2\"",
            Self::Conductance => "a heat transfer coefficient such as \"500 W/m^2/K\"",
            Self::ContactResistance => "a contact resistance such as \"2e-3 m^2 K/W\"",
            Self::MassFlux => "a film coefficient such as \"0.3 kg/m^2/s\"",
            Self::VolumeConductance => "a conductance in a volume such as \"20 kW/m^3/K\"",
            Self::Conductivity => "a conductivity such as \"0.05 W/m/K\"",
            Self::SpecificEnthalpy => "an enthalpy such as \"12 MJ/kg\"",
            Self::HeatCapacity => "a heat capacity such as \"900 J/kg/K\"",
            Self::Density => "a density such as \"170 kg/m^3\"",
            Self::Extinction => "an extinction such as \"4500 1/m\"",
            Self::SpecificExtinction => "a specific extinction such as \"27.4 m^2/kg\"",
            Self::Permeability => "a permeability such as \"1e-11 m^2\"",
            Self::InertialCoefficient => "an inertial coefficient such as \"1e5 1/m\"",
            Self::Rate => "a rate such as \"1.2e4 1/s\"",
            Self::MolarEnergy => "an activation energy such as \"150 kJ/mol\"",
            Self::MolarMass => "a molar mass such as \"25 g/mol\"",
            Self::Viscosity => "a viscosity such as \"1.8e-5 Pa*s\"",
            Self::Fraction => "a fraction such as \"0.85\" or \"85 %\"",
        }
    }

    fn exponents(self) -> Exponents {
        match self {
            Self::Length => [0, 1, 0, 0, 0],
            Self::Time => [0, 0, 1, 0, 0],
            Self::Temperature | Self::LayupTemperature | Self::Surroundings | Self::TemperatureDifference => {
                [0, 0, 0, 1, 0]
            }
            Self::Pressure => [1, -1, -2, 0, 0],
            Self::HeatFlux => [1, 0, -3, 0, 0],
            Self::Conductance => [1, 0, -3, -1, 0],
            Self::ContactResistance => [-1, 0, 3, 1, 0],
            Self::MassFlux => [1, -2, -1, 0, 0],
            Self::VolumeConductance => [1, -1, -3, -1, 0],
            Self::Conductivity => [1, 1, -3, -1, 0],
            Self::SpecificEnthalpy => [0, 2, -2, 0, 0],
            Self::HeatCapacity => [0, 2, -2, -1, 0],
            Self::Density => [1, -3, 0, 0, 0],
            Self::Extinction => [0, -1, 0, 0, 0],
            Self::SpecificExtinction => [-1, 2, 0, 0, 0],
            Self::Permeability => [0, 2, 0, 0, 0],
            Self::InertialCoefficient => [0, -1, 0, 0, 0],
            Self::Rate => [0, 0, -1, 0, 0],
            Self::MolarEnergy => [1, 2, -2, 0, -1],
            Self::MolarMass => [1, 0, 0, 0, -1],
            Self::Viscosity => [1, -1, -1, 0, 0],
            Self::Fraction => [0, 0, 0, 0, 0],
        }
    }

    /// Whether a quantity of this kind can have this value in SI.
    pub fn is_allowed(self, value: f64) -> bool {
        match self {
            Self::Temperature => value > 0.0,
            Self::LayupTemperature => value > 0.0 && value <= LAYUP_TEMPERATURE_K.max as f64,
            Self::Surroundings => value >= 0.0,
            _ => true,
        }
    }

    /// The reason why a value is not allowed.
    pub fn violation(self, value: f64) -> String {
        match self {
            Self::Surroundings => "below absolute zero".to_owned(),
            Self::LayupTemperature if value > 0.0 => {
                format!("above {} K, the highest temperature of a march", LAYUP_TEMPERATURE_K.max)
            }
            _ => "not above absolute zero".to_owned(),
        }
    }

    /// The name of the quantity with these exponents: `a length`.
    fn name_of_exponents(powers: Exponents) -> &'static str {
        const ALL: [Dimension; 21] = [
            Dimension::Length,
            Dimension::Time,
            Dimension::Temperature,
            Dimension::Pressure,
            Dimension::HeatFlux,
            Dimension::Conductance,
            Dimension::ContactResistance,
            Dimension::MassFlux,
            Dimension::VolumeConductance,
            Dimension::Conductivity,
            Dimension::SpecificEnthalpy,
            Dimension::HeatCapacity,
            Dimension::Density,
            Dimension::Extinction,
            Dimension::SpecificExtinction,
            Dimension::Permeability,
            Dimension::Rate,
            Dimension::MolarEnergy,
            Dimension::MolarMass,
            Dimension::Viscosity,
            Dimension::Fraction,
        ];
        ALL.iter()
            .find(|dimension| dimension.exponents() == powers)
            .and_then(|dimension| dimension.name_and_example().split(" such as").next())
            .unwrap_or("a quantity in this unit")
    }
}

/// Name, value in SI and exponents of a unit.
type Unit = (&'static str, f64, Exponents);

/// The pound-force: a pound under standard gravity, N.
const POUND_FORCE_N: f64 = 0.45359237 * 9.80665;

const UNITS: &[Unit] = &[
    ("m", 1.0, [0, 1, 0, 0, 0]),
    ("km", 1e3, [0, 1, 0, 0, 0]),
    ("cm", 1e-2, [0, 1, 0, 0, 0]),
    ("mm", 1e-3, [0, 1, 0, 0, 0]),
    ("um", 1e-6, [0, 1, 0, 0, 0]),
    ("µm", 1e-6, [0, 1, 0, 0, 0]),
    ("μm", 1e-6, [0, 1, 0, 0, 0]),
    ("nm", 1e-9, [0, 1, 0, 0, 0]),
    ("in", 0.0254, [0, 1, 0, 0, 0]),
    ("mil", 2.54e-5, [0, 1, 0, 0, 0]),
    ("ft", 0.3048, [0, 1, 0, 0, 0]),
    ("s", 1.0, [0, 0, 1, 0, 0]),
    ("ms", 1e-3, [0, 0, 1, 0, 0]),
    ("min", 60.0, [0, 0, 1, 0, 0]),
    ("h", 3600.0, [0, 0, 1, 0, 0]),
    ("hr", 3600.0, [0, 0, 1, 0, 0]),
    ("d", 86_400.0, [0, 0, 1, 0, 0]),
    ("day", 86_400.0, [0, 0, 1, 0, 0]),
    ("days", 86_400.0, [0, 0, 1, 0, 0]),
    ("K", 1.0, [0, 0, 0, 1, 0]),
    ("degC", 1.0, [0, 0, 0, 1, 0]),
    ("°C", 1.0, [0, 0, 0, 1, 0]),
    ("degF", 1.0 / 1.8, [0, 0, 0, 1, 0]),
    ("°F", 1.0 / 1.8, [0, 0, 0, 1, 0]),
    ("degR", 1.0 / 1.8, [0, 0, 0, 1, 0]),
    ("°R", 1.0 / 1.8, [0, 0, 0, 1, 0]),
    ("R", 1.0 / 1.8, [0, 0, 0, 1, 0]),
    ("kg", 1.0, [1, 0, 0, 0, 0]),
    ("g", 1e-3, [1, 0, 0, 0, 0]),
    ("lb", 0.45359237, [1, 0, 0, 0, 0]),
    ("lbm", 0.45359237, [1, 0, 0, 0, 0]),
    ("mol", 1.0, [0, 0, 0, 0, 1]),
    ("kmol", 1e3, [0, 0, 0, 0, 1]),
    ("N", 1.0, [1, 1, -2, 0, 0]),
    ("lbf", POUND_FORCE_N, [1, 1, -2, 0, 0]),
    ("Pa", 1.0, [1, -1, -2, 0, 0]),
    ("hPa", 1e2, [1, -1, -2, 0, 0]),
    ("kPa", 1e3, [1, -1, -2, 0, 0]),
    ("MPa", 1e6, [1, -1, -2, 0, 0]),
    ("bar", 1e5, [1, -1, -2, 0, 0]),
    ("mbar", 1e2, [1, -1, -2, 0, 0]),
    ("atm", 101325.0, [1, -1, -2, 0, 0]),
    ("torr", 101325.0 / 760.0, [1, -1, -2, 0, 0]),
    ("psi", POUND_FORCE_N / (0.0254 * 0.0254), [1, -1, -2, 0, 0]),
    ("psia", POUND_FORCE_N / (0.0254 * 0.0254), [1, -1, -2, 0, 0]),
    ("psf", POUND_FORCE_N / (0.3048 * 0.3048), [1, -1, -2, 0, 0]),
    ("J", 1.0, [1, 2, -2, 0, 0]),
    ("kJ", 1e3, [1, 2, -2, 0, 0]),
    ("MJ", 1e6, [1, 2, -2, 0, 0]),
    ("cal", 4.184, [1, 2, -2, 0, 0]),
    ("kcal", 4184.0, [1, 2, -2, 0, 0]),
    ("BTU", 1055.05585262, [1, 2, -2, 0, 0]),
    ("Btu", 1055.05585262, [1, 2, -2, 0, 0]),
    ("W", 1.0, [1, 2, -3, 0, 0]),
    ("mW", 1e-3, [1, 2, -3, 0, 0]),
    ("kW", 1e3, [1, 2, -3, 0, 0]),
    ("MW", 1e6, [1, 2, -3, 0, 0]),
    ("1", 1.0, [0, 0, 0, 0, 0]),
    ("%", 1e-2, [0, 0, 0, 0, 0]),
];

/// Parse a quantity into SI.
///
/// # Errors
/// A message with the expected and the found text, if there is no number or no unit, the unit is unknown or of another
/// dimension, or the number is not finite.
pub fn parse_quantity(text: &str, dimension: Dimension) -> Result<f64, String> {
    let text = text.trim();
    let expected = dimension.name_and_example();
    let (number, unit) = split_number_and_unit(text);
    let value: f64 = number.parse().map_err(|_| format!("not a quantity: expected {expected}, found {text:?}"))?;
    if !value.is_finite() {
        return Err(format!("not a finite number: expected {expected}, found {text:?}"));
    }
    if unit.is_empty() {
        if dimension == Dimension::Fraction {
            return Ok(value);
        }
        return Err(format!("missing unit: expected {expected}, found {text:?}"));
    }
    let (scale, offset) = unit_conversion(unit, dimension).map_err(|message| format!("{message}, found {text:?}"))?;
    let value = value * scale + offset;
    if !value.is_finite() {
        return Err(format!("not a finite number in SI: expected {expected}, found {text:?}"));
    }
    if !dimension.is_allowed(value) {
        return Err(format!("{}: expected {expected}, found {text:?}", dimension.violation(value)));
    }
    Ok(value)
}

/// Scale and offset that convert a unit to SI: `value × scale + one_sided_offset`. The offset is zero except for °C and
/// °F.
///
/// # Errors
/// A message with the expected quantity, if the unit is unknown or of another dimension.
pub fn unit_conversion(unit: &str, dimension: Dimension) -> Result<(f64, f64), String> {
    let expected = dimension.name_and_example();
    let unit = canonical(unit);
    let (scale, powers) = compound_unit(unit).map_err(|reason| format!("{reason}: expected {expected}"))?;
    if powers != dimension.exponents() {
        let hint = intended_unit(unit, dimension)
            .map_or(String::new(), |meant| format!(": a space multiplies; write {meant:?}"));
        return Err(format!(
            "wrong dimension: expected {expected}, not {}{hint}",
            Dimension::name_of_exponents(powers)
        ));
    }
    let offset = match (dimension, unit) {
        (Dimension::Temperature | Dimension::LayupTemperature | Dimension::Surroundings, "degC" | "°C") => 273.15,
        (Dimension::Temperature | Dimension::LayupTemperature | Dimension::Surroundings, "degF" | "°F") => {
            459.67 / 1.8
        }
        _ => 0.0,
    };
    Ok((scale, offset))
}

/// Whether a text is a unit of any dimension.
pub(crate) fn is_unit(text: &str) -> bool {
    compound_unit(canonical(text)).is_ok()
}

/// Degrees as loggers write them, `Deg C` or `degrees Fahrenheit`, as the unit of the list.
fn canonical(unit: &str) -> &str {
    let plain = unit.to_lowercase().replace([' ', '.', '_'], "");
    let scale = ["degrees", "degree", "deg", "°"].into_iter().find_map(|word| plain.strip_prefix(word));
    match scale.unwrap_or(&plain) {
        "celsius" => "degC",
        "fahrenheit" => "degF",
        "c" if scale.is_some() => "degC",
        "f" if scale.is_some() => "degF",
        _ => unit,
    }
}

/// The correct form of a unit such as `W/m^2 K`, which reads as (W/m²)·K.
fn intended_unit(unit: &str, dimension: Dimension) -> Option<String> {
    let (over, under) = unit.split_once('/')?;
    let divided = format!("{over}/{}", under.split_whitespace().collect::<Vec<_>>().join("/"));
    let is_meant = divided != unit && compound_unit(&divided).is_ok_and(|(_, powers)| powers == dimension.exponents());
    is_meant.then_some(divided)
}

/// The number and the unit of `"26.7 W/cm^2"`; the space is optional.
///
/// The number is the longest prefix that parses as one: `1e3Pa` is a thousand pascals.
fn split_number_and_unit(text: &str) -> (&str, &str) {
    if let Some((number, unit)) = text.split_once(char::is_whitespace) {
        return (number, unit.trim());
    }
    let ends = text.char_indices().map(|(at, _)| at).chain([text.len()]);
    let number = ends.filter(|&end| text[..end].parse::<f64>().is_ok()).max().unwrap_or(text.len());
    (&text[..number], &text[number..])
}

/// Longest unit in bytes: limits the recursion into parentheses.
const MAX_UNIT_BYTES: usize = 64;

/// Scale and exponents of a compound unit.
fn compound_unit(unit: &str) -> Result<(f64, Exponents), String> {
    if unit.len() > MAX_UNIT_BYTES {
        return Err(format!("the unit is too long: expected at most {MAX_UNIT_BYTES} bytes, found {}", unit.len()));
    }
    let mut rest = unit;
    let found = product(&mut rest, unit)?;
    if rest.is_empty() { Ok(found) } else { Err(format!("unit {unit:?} is not understood at {rest:?}")) }
}

/// Factors joined by `/`, `*`, `·`, `-` and spaces, up to the end or a closing parenthesis.
fn product(rest: &mut &str, whole: &str) -> Result<(f64, Exponents), String> {
    let (mut scale, mut powers) = power(rest, whole)?;
    let mut sign = 1;
    loop {
        let trimmed = rest.trim_start();
        sign = match trimmed.chars().next() {
            Some(joint) if "/*·-".contains(joint) => {
                *rest = trimmed[joint.len_utf8()..].trim_start();
                match joint {
                    '/' => -1,
                    '-' => sign,
                    _ => 1,
                }
            }
            Some(next) if next != ')' && trimmed.len() < rest.len() => {
                *rest = trimmed;
                1
            }
            _ => {
                *rest = trimmed;
                return Ok((scale, powers));
            }
        };
        let (factor, more) = power(rest, whole)?;
        scale *= factor.powi(sign);
        powers = std::array::from_fn(|i| powers[i] + sign * more[i]);
    }
}

/// A named unit or a parenthesis, raised to a power.
fn power(rest: &mut &str, whole: &str) -> Result<(f64, Exponents), String> {
    let (scale, powers) = if let Some(inner) = rest.strip_prefix('(') {
        *rest = inner;
        let found = product(rest, whole)?;
        *rest = rest.strip_prefix(')').ok_or_else(|| format!("unit {whole:?} lacks a closing parenthesis"))?;
        found
    } else {
        let end = if rest.starts_with('1') {
            1
        } else {
            rest.find(|c: char| "/*·-^()²³".contains(c) || c.is_ascii_digit() || c.is_whitespace())
                .unwrap_or(rest.len())
        };
        let (name, after) = rest.split_at(end);
        let &(_, scale, powers) =
            UNITS.iter().find(|(known, ..)| *known == name).ok_or_else(|| format!("unknown unit {whole:?}"))?;
        *rest = after;
        (scale, powers)
    };
    let digits = rest.trim_start_matches('^');
    let (exponent, after) = match digits.chars().next() {
        Some('²') => (2, &digits['²'.len_utf8()..]),
        Some('³') => (3, &digits['³'.len_utf8()..]),
        Some(digit @ '1'..='9') => (digit as i32 - '0' as i32, &digits[1..]),
        _ => (1, *rest),
    };
    *rest = after;
    Ok((scale.powi(exponent), powers.map(|power| power * exponent)))
}

#[cfg(test)]
mod tests;
