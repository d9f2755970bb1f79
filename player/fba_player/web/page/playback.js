/** The clock of a player: time that goes on, at a speed, in a loop, with the sound as its master. */

export const SPEEDS = [0.1, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 2, 4];
const FARTHEST_FROM_SOUND = 0.08; // seconds; the clock is set to the sound when it is off by more
const DRAWN_TO_SOUND = 0.1; // share of the difference that is made up in each picture

/** Time of a performance. `now` is a clock in seconds, that of the page unless a test has another. */
export class Playback {
  /** @param {() => number} [now] */
  constructor(now = () => performance.now() / 1000) {
    this._now = now;
    this.start = 0;
    this.end = 0;
    this.time = 0;
    this.playing = false;
    this.speed = 1;
    this.loop = false;
    /** The part that is played: from and to, null for the whole. @type {[number, number] | null} */
    this.part = null;
    /** @type {HTMLAudioElement | null} */
    this.audio = null;
    /** Seconds by which the sound begins later than the first frame. */
    this.audioOffset = 0;
    this._last = 0;
  }

  /** Set the span of the performance; the time stays within. @param {number} start @param {number} end */
  span(start, end) {
    this.start = start;
    this.end = end;
    this.part = null;
    this.seek(this.time);
  }

  get first() {
    return this.part ? this.part[0] : this.start;
  }

  get last() {
    return this.part ? this.part[1] : this.end;
  }

  play() {
    if (this.playing || this.end <= this.start) return;
    if (this.time >= this.last - 1e-6 || this.time < this.first) this.seek(this.first);
    this.playing = true;
    this._last = this._now();
    this._soundOn();
  }

  pause() {
    this.playing = false;
    this.audio?.pause();
  }

  /** @param {number} time seconds */
  seek(time) {
    this.time = Math.min(Math.max(time, this.start), this.end);
    if (this.audio && Number.isFinite(this.audio.duration)) {
      const at = this.time - this.start - this.audioOffset;
      if (at >= 0 && at < this.audio.duration) this.audio.currentTime = at;
      if (this.playing) this._soundOn();
    }
  }

  /** @param {number} speed */
  setSpeed(speed) {
    this.speed = speed;
    if (this.audio) this.audio.playbackRate = speed;
  }

  /** Go on to now; return whether playing ended. */
  advance() {
    if (!this.playing) return false;
    const now = this._now();
    this.time += (now - this._last) * this.speed;
    this._last = now;
    this._followSound();
    if (this.time < this.last) return false;
    if (this.loop) {
      this.seek(this.first + ((this.time - this.last) % Math.max(this.last - this.first, 1e-3)));
      return false;
    }
    this.time = this.last;
    this.pause();
    return true;
  }

  /** The sound is the clock: it never jumps, but the pictures may. */
  _followSound() {
    const { audio } = this;
    if (!audio) return;
    const at = this.time - this.start - this.audioOffset;
    if (audio.paused) {
      if (at >= 0 && at < audio.duration && !audio.ended) this._soundOn();
      return;
    }
    const off = audio.currentTime - at;
    this.time += Math.abs(off) > FARTHEST_FROM_SOUND ? off : off * DRAWN_TO_SOUND;
  }

  _soundOn() {
    const { audio } = this;
    if (!audio || !this.playing) return;
    const at = this.time - this.start - this.audioOffset;
    if (at < 0 || !(at < audio.duration)) {
      audio.pause();
      return;
    }
    if (Math.abs(audio.currentTime - at) > FARTHEST_FROM_SOUND) audio.currentTime = at;
    audio.playbackRate = this.speed;
    audio.play().catch(() => {}); // a browser may forbid sound until the reader has clicked
  }
}
