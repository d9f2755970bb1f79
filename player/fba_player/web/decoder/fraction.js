/** Exact fractions, in which frame rates and times are counted. */
export class Fraction {
  /** @param {bigint} numerator @param {bigint} [denominator] above 0 */
  constructor(numerator, denominator = 1n) {
    const divisor = greatestDivisor(numerator < 0n ? -numerator : numerator, denominator);
    this.numerator = numerator / divisor;
    this.denominator = denominator / divisor;
  }

  /** @param {number} numerator integer @param {number} [denominator] integer above 0 */
  static of(numerator, denominator = 1) {
    return new Fraction(BigInt(numerator), BigInt(denominator));
  }

  /** @param {Fraction} other */
  plus(other) {
    return new Fraction(
      this.numerator * other.denominator + other.numerator * this.denominator,
      this.denominator * other.denominator,
    );
  }

  /** @param {Fraction} other */
  minus(other) {
    return this.plus(new Fraction(-other.numerator, other.denominator));
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

  /** @param {Fraction | null} other */
  equals(other) {
    return other !== null && this.numerator === other.numerator && this.denominator === other.denominator;
  }

  floor() {
    const quotient = this.numerator / this.denominator;
    return Number(quotient * this.denominator > this.numerator ? quotient - 1n : quotient);
  }

  ceil() {
    return -new Fraction(-this.numerator, this.denominator).floor();
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
