//! Quantities with units, and the messages for wrong ones.

use super::*;

#[test]
fn quantities_are_converted_to_si() {
    let known: &[(&str, Dimension, f64)] = &[
        ("0.51 mm", Dimension::Length, 0.51e-3),
        ("2in", Dimension::Length, 0.0508),
        ("26.7 W/cm^2", Dimension::HeatFlux, 26.7e4),
        ("26.7 W/cm2", Dimension::HeatFlux, 26.7e4),
        ("26.7 W/cm²", Dimension::HeatFlux, 26.7e4),
        ("1 BTU/ft2/s", Dimension::HeatFlux, 1055.05585262 / 0.09290304),
        ("8.01 kPa", Dimension::Pressure, 8010.0),
        ("1 atm", Dimension::Pressure, 101325.0),
        ("760 torr", Dimension::Pressure, 101325.0),
        ("12 MJ/kg", Dimension::SpecificEnthalpy, 12e6),
        ("500 W/m^2/K", Dimension::Conductance, 500.0),
        ("500 W/(m^2*K)", Dimension::Conductance, 500.0),
        ("500 W/(m^2 K)", Dimension::Conductance, 500.0),
        ("1.8e-5 Pa s", Dimension::Viscosity, 1.8e-5),
        ("20 kW/m^3/K", Dimension::VolumeConductance, 20e3),
        ("300 K", Dimension::Temperature, 300.0),
        ("20 degC", Dimension::Temperature, 293.15),
        ("68 degF", Dimension::Temperature, 293.15),
        ("0 K", Dimension::Surroundings, 0.0),
        ("-273.15 degC", Dimension::Surroundings, 0.0),
        ("2 degC", Dimension::TemperatureDifference, 2.0),
        ("-1.5e1 s", Dimension::Time, -15.0),
        ("2 min", Dimension::Time, 120.0),
        ("1e3 1/m", Dimension::Extinction, 1000.0),
        ("27.4 m^2/kg", Dimension::SpecificExtinction, 27.4),
        ("150 kJ/mol", Dimension::MolarEnergy, 150e3),
        ("22 kg/kmol", Dimension::MolarMass, 0.022),
        ("1.2e4 1/s", Dimension::Rate, 1.2e4),
        ("1.8e-5 Pa*s", Dimension::Viscosity, 1.8e-5),
        ("1.6e-11 m^2", Dimension::Permeability, 1.6e-11),
        ("85 %", Dimension::Fraction, 0.85),
        ("0.85", Dimension::Fraction, 0.85),
        ("0.25 cal/g/K", Dimension::HeatCapacity, 1046.0),
        ("0.1 lb/ft^2/s", Dimension::MassFlux, 0.488242763638305),
        ("2e-3 m^2 K/W", Dimension::ContactResistance, 2e-3),
        ("2e-3 m^2*K/W", Dimension::ContactResistance, 2e-3),
        // NIST SP 811, appendix B.
        ("540 degR", Dimension::Temperature, 300.0),
        ("540 °R", Dimension::Temperature, 300.0),
        ("1 psi", Dimension::Pressure, 6894.757293168361),
        ("2116.21662367394 psf", Dimension::Pressure, 101325.0),
        ("1 lbf/ft^2", Dimension::Pressure, 47.88025898033584),
        ("1 lb/ft^3", Dimension::Density, 16.01846337396014),
        ("1 BTU/lb/degR", Dimension::HeatCapacity, 4186.8),
        ("1 Btu/lbm-R", Dimension::HeatCapacity, 4186.8),
        ("1 BTU/lb", Dimension::SpecificEnthalpy, 2326.0),
        ("1 BTU/ft/s/degR", Dimension::Conductivity, 6230.644798937),
        ("1 Btu/ft-s-R", Dimension::Conductivity, 6230.644798937),
        ("1 Btu/hr-ft-°F", Dimension::Conductivity, 1.730734666371),
        ("1 BTU/ft^2/s", Dimension::HeatFlux, 11356.526682227),
        ("1 Btu/ft2-s", Dimension::HeatFlux, 11356.526682227),
        ("1 W/m-K", Dimension::Conductivity, 1.0),
    ];
    for &(text, dimension, expected) in known {
        let found = parse_quantity(text, dimension).unwrap_or_else(|message| panic!("{text}: {message}"));
        assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{text}: {found}, expected {expected}");
    }
}

#[test]
fn every_wrong_quantity_is_reported_with_the_expected_and_the_found_text() {
    let wrong: &[(&str, Dimension, &str)] = &[
        ("26.7", Dimension::HeatFlux, "missing unit: expected a heat flux such as \"26.7 W/cm^2\", found \"26.7\""),
        ("3 mm", Dimension::HeatFlux, "wrong dimension: expected a heat flux"),
        ("3 mm", Dimension::HeatFlux, "not a length, found \"3 mm\""),
        ("3 kJ/kg", Dimension::MolarEnergy, "expected an activation energy such as \"150 kJ/mol\", not an enthalpy"),
        ("3 W/m^2 K", Dimension::Conductance, "wrong dimension: expected a heat transfer coefficient"),
        ("3 W/m^2 K", Dimension::Conductance, ": a space multiplies; write \"W/m^2/K\", found \"3 W/m^2 K\""),
        ("9 J/kg K", Dimension::HeatCapacity, ": a space multiplies; write \"J/kg/K\""),
        ("9 W/m^2 s", Dimension::Conductance, "not a quantity in this unit, found \"9 W/m^2 s\""),
        ("9 W-s/m^2", Dimension::HeatFlux, "wrong dimension: expected a heat flux"),
        ("9 W m-1 K-1", Dimension::Conductivity, "wrong dimension: expected a conductivity"),
        ("3 W/m^2 )", Dimension::Conductance, "is not understood at \")\""),
        ("3 furlong", Dimension::Length, "unknown unit \"furlong\""),
        ("3 (m", Dimension::Length, "lacks a closing parenthesis"),
        ("3 ((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((m", Dimension::Length, "too long"),
        ("three mm", Dimension::Length, "not a quantity"),
        ("", Dimension::Length, "not a quantity"),
        ("NaN mm", Dimension::Length, "not a finite number"),
        ("inf s", Dimension::Time, "not a finite number"),
        ("1e308 km", Dimension::Length, "not a finite number in SI"),
        ("-300 degC", Dimension::Temperature, "not above absolute zero"),
        ("0 K", Dimension::Temperature, "not above absolute zero"),
        ("-1 K", Dimension::Surroundings, "below absolute zero"),
    ];
    for &(text, dimension, fragment) in wrong {
        let message = parse_quantity(text, dimension).expect_err(text);
        assert!(message.contains(fragment), "{text}: {message}");
    }
}
