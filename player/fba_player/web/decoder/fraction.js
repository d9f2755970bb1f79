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

  /** @param {Fraction} other */
  plus(other) {
    const numerator = this.numerator * other.denominator + other.numerator * this.denominator;
    return new Fraction(numerator, this.denominator * other.denominator);
  }

  /** @param {Fraction} other */
  times(other) {
    return new Fraction(this.numerator * other.numerator, this.denominator * other.denominator);
  }

  /** @param {Fraction} other above 0 */
  over(other) {
    return new Fraction(this.numerator * other.denominator, this.denominator * other.numerator);
  }

  /** Return a number below, at or above 0, as this is less than, equal to or more than the other. @param {Fraction} other */
  compare(other) {
    return Number(this.numerator * other.denominator - other.numerator * this.denominator);
  }

  /** Return the whole number below, or with 1 / 2 the nearest one. @param {bigint} [up] numerator of what is added */
  floor(up = 0n) {
    return Number((2n * this.numerator + up * this.denominator) / (2n * this.denominator));
  }

  valueOf() {
    return Number(this.numerator) / Number(this.denominator);
  }

  toString() {
    return this.denominator === 1n ? `${this.numerator}` : `${this.numerator}/${this.denominator}`;
  }
}

/** @param {bigint} a @param {bigint} b */
export function greatestDivisor(a, b) {
  while (b) [a, b] = [b, a % b];
  return a;
}
