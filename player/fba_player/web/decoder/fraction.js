const MOST = 1n << 96n; // denominator, which many odd changes of the frame rate exceed: only then fractions are rounded
const FINE = 1n << 48n;

/** Exact fractions, not negative, in which frame rates and times are counted. */
export class Fraction {
  /** @param {bigint | number} numerator integer @param {bigint | number} [denominator] integer above 0 */
  constructor(numerator, denominator = 1) {
    const [above, below] = [BigInt(numerator), BigInt(denominator)];
    const divisor = greatestDivisor(above, below);
    this.numerator = above / divisor;
    this.denominator = below / divisor;
    if (this.denominator > MOST) [this.numerator, this.denominator] = [(FINE * above) / below, FINE];
  }

  valueOf() {
    return Number(this.numerator) / Number(this.denominator);
  }

  toString() {
    return this.numerator + (this.denominator > 1n ? `/${this.denominator}` : "");
  }
}

/** @param {Fraction} one @param {Fraction} other */
export const sum = (one, other) =>
  new Fraction(one.numerator * other.denominator + other.numerator * one.denominator, one.denominator * other.denominator);

/** @param {Fraction} one @param {Fraction} other */
export const product = (one, other) =>
  new Fraction(one.numerator * other.numerator, one.denominator * other.denominator);

/** Return 1 / a fraction above 0. @param {Fraction} fraction */
export const inverse = ({ numerator, denominator }) => new Fraction(denominator, numerator);

/** Return a number below, at or above 0, as one is less than, equal to or more than the other. @param {Fraction} one @param {Fraction} other */
export const compare = (one, other) => Number(one.numerator * other.denominator - other.numerator * one.denominator);

/** Return the nearest whole number; halves are rounded up. @param {Fraction} fraction */
export const nearest = ({ numerator, denominator }) => Number((2n * numerator + denominator) / (2n * denominator));

/** @param {bigint} one @param {bigint} other @returns {bigint} */
export const greatestDivisor = (one, other) => (other ? greatestDivisor(other, one % other) : one);
