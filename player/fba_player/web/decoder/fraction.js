const MOST = 1n << 96n; // denominator, which many odd changes of the frame rate exceed: only then fractions are rounded
const FINE = 1n << 48n;

/** An exact fraction, not negative, in which frame rates and times are counted: numerator, denominator. @typedef {[bigint, bigint]} Fraction */

/** Return a fraction in lowest terms. @param {bigint | number} numerator integer @param {bigint | number} [denominator] integer above 0 @returns {Fraction} */
export function fraction(numerator, denominator = 1) {
  const [above, below] = [BigInt(numerator), BigInt(denominator)];
  const divisor = greatestDivisor(above, below);
  return below / divisor > MOST ? [(FINE * above) / below, FINE] : [above / divisor, below / divisor];
}

/** @param {Fraction} fraction */
export const value = ([above, below]) => Number(above) / Number(below);

/** @param {Fraction} one @param {Fraction} other */
export const sum = ([a, b], [c, d]) => fraction(a * d + c * b, b * d);

/** @param {Fraction} one @param {Fraction} other */
export const product = ([a, b], [c, d]) => fraction(a * c, b * d);

/** Return 1 / a fraction above 0. @param {Fraction} fraction @returns {Fraction} */
export const inverse = ([a, b]) => [b, a];

/** Return a number below, at or above 0, as one is less than, equal to or more than the other. @param {Fraction} one @param {Fraction} other */
export const compare = ([a, b], [c, d]) => Number(a * d - c * b);

/** Return the nearest whole number; halves are rounded up. @param {Fraction} fraction */
export const nearest = ([a, b]) => Number((2n * a + b) / (2n * b));

/** Return it as text. @param {Fraction} fraction */
export const text = ([a, b]) => (b > 1n ? `${a}/${b}` : `${a}`);

/** @param {bigint} one @param {bigint} other @returns {bigint} */
export const greatestDivisor = (one, other) => (other ? greatestDivisor(other, one % other) : one);
