// Exponential, logarithm and powers of our own: twin of src/physics/exponential.rs.

struct ExpParts {
    two_to: real,
    part: real,
}

fn two_terms(term: real, next: real, rest: real) -> real {
    return term + keep(next * rest);
}

fn four_terms(term: real, second: real, third: real, fourth: real, rest: real, square: real) -> real {
    return two_terms(term, second, rest) + keep(two_terms(third, fourth, rest) * square);
}

fn power_of_e(x: real) -> ExpParts {
    let bounded = min(max(x, real(-EXP_ARGUMENT_MAX)), real(EXP_ARGUMENT_MAX));
    let exponent = nearest(bounded * real(LOG2_E));
    let rest = keep(bounded - exponent * real(LN_2_HIGH)) - exponent * real(LN_2_LOW);
    let square = keep(rest * rest);
    let fourth = keep(square * square);
    var sum: real;
    if DIGITS > 23u {
        let low = four_terms(SERIES_F64_0, SERIES_F64_1, SERIES_F64_2, SERIES_F64_3, rest, square)
            + keep(four_terms(SERIES_F64_4, SERIES_F64_5, SERIES_F64_6, SERIES_F64_7, rest, square) * fourth);
        let high = two_terms(SERIES_F64_8, SERIES_F64_9, rest) + keep(SERIES_F64_10 * square);
        sum = low + keep(high * keep(fourth * fourth));
    } else {
        sum = four_terms(SERIES_F32_0, SERIES_F32_1, SERIES_F32_2, SERIES_F32_3, rest, square)
            + keep(two_terms(SERIES_F32_4, SERIES_F32_5, rest) * fourth);
    }
    return ExpParts(two_to(exponent), keep(sum * rest));
}

fn exponential(x: real) -> real {
    let power = power_of_e(x);
    return (power.part + 1.0) * power.two_to;
}

fn decay(x: real) -> real {
    let power = power_of_e(-x);
    return (1.0 - power.two_to) - power.two_to * power.part;
}

fn logarithm(x: real) -> real {
    let exponent = twos_of(x);
    let mantissa = mantissa_of(x);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    var sum = real(1.0 / 11.0);
    sum = keep(sum * square) + real(1.0 / 9.0);
    sum = keep(sum * square) + real(1.0 / 7.0);
    sum = keep(sum * square) + real(1.0 / 5.0);
    sum = keep(sum * square) + real(1.0 / 3.0);
    sum = keep(sum * square) + 1.0;
    let near = exponent * real(LN_2) + keep((s + s) * sum);
    let back = exponential(near);
    return near + (x - back) * 2.0 / (x + back);
}

fn power(x: real, m: real) -> real {
    return exponential(m * logarithm(max(x, real(1e-30))));
}
