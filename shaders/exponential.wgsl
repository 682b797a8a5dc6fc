// Exponential, logarithm and powers of our own: twin of src/physics/exponential.rs.

const LOG2_E = 1.4426950408889634;
const LN_2 = 0.6931471805599453;
const LN_2_HIGH = 0.693145751953125;
const LN_2_LOW = 1.4286068203094172e-6;
const LARGEST = 80.0;

struct Power {
    two_to: real,
    part: real,
}

fn two_terms(n: u32, rest: real) -> real {
    switch n {
        case 0u: { return real(1.0) + keep(0.5 * rest); }
        case 2u: { return real(1.0 / 6.0) + keep(real(1.0 / 24.0) * rest); }
        case 4u: { return real(1.0 / 120.0) + keep(real(1.0 / 720.0) * rest); }
        case 6u: { return real(1.0 / 5040.0) + keep(real(1.0 / 40320.0) * rest); }
        case 8u: { return real(1.0 / 362880.0) + keep(real(1.0 / 3628800.0) * rest); }
        default: { return real(1.0 / 39916800.0) + keep(real(1.0 / 479001600.0) * rest); }
    }
}

fn four_terms(n: u32, rest: real, square: real) -> real {
    return two_terms(n, rest) + keep(two_terms(n + 2u, rest) * square);
}

fn power_of_e(x: real) -> Power {
    let bounded = min(max(x, real(-LARGEST)), real(LARGEST));
    let twos = nearest(bounded * real(LOG2_E));
    let rest = keep(bounded - twos * real(LN_2_HIGH)) - twos * real(LN_2_LOW);
    let square = keep(rest * rest);
    let fourth = keep(square * square);
    var sum = four_terms(0u, rest, square) + keep(four_terms(4u, rest, square) * fourth);
    if DIGITS > 23u {
        let high = four_terms(8u, rest, square) + keep(real(1.0 / 6227020800.0) * fourth);
        sum = sum + keep(high * keep(fourth * fourth));
    }
    return Power(two_to(twos), keep(sum * rest));
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
    let twos = twos_of(x);
    let mantissa = mantissa_of(x);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    var sum = real(1.0 / 11.0);
    sum = keep(sum * square) + real(1.0 / 9.0);
    sum = keep(sum * square) + real(1.0 / 7.0);
    sum = keep(sum * square) + real(1.0 / 5.0);
    sum = keep(sum * square) + real(1.0 / 3.0);
    sum = keep(sum * square) + 1.0;
    let near = twos * real(LN_2) + keep((s + s) * sum);
    let back = exponential(near);
    return near + (x - back) * 2.0 / (x + back);
}

fn power(x: real, m: real) -> real {
    return exponential(m * logarithm(max(x, real(1e-30))));
}
