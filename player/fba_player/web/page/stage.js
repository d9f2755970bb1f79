/** The picture: a canvas, its camera, and what pointers and fingers do with it. */
import { Camera, VIEWS, clamped } from "./camera.js";
import { Renderer } from "./renderer.js";

/**
 * A figure that can be posed. subject: the head at the start. bodySubject: the body over the whole performance. follows:
 * whether it goes so far that the camera goes with its root. pose: returns what is drawn for FAPs (68) and BAPs (296).
 * @typedef {{
 *   hasBody: boolean, subject: import("./camera.js").Subject, bodySubject: import("./camera.js").Subject | null,
 *   follows: boolean, root: number[],
 *   pose(faps: Float32Array, baps: Float64Array): import("./renderer.js").View,
 * }} Figure
 *
 * A performance on the stage.
 * @typedef {{
 *   name: string, figure: Figure, timeline: import("./timeline.js").Timeline | import("./timeline.js").LiveTimeline,
 * }} Performer
 */

const TURN = 0.4; // degrees a pixel
const GAP = 0.1; // between figures side by side, share of their width
const FADE = 0.35; // seconds in which the camera goes to a named view
const MOST_PIXELS = 2;

export class Stage {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    /** @type {Performer[]} */
    this.performers = [];
    this.camera = new Camera();
    /** @type {number[] | null} */
    this.background = null;
    /** Called when a picture is needed. @type {() => void} */
    this.onchange = () => {};
    this._view = "";
    /** @type {{from: Camera, to: Camera, since: number} | null} */
    this._flight = null;
    this._faps = new Float32Array(68);
    this._baps = new Float64Array(296);
    this.resize(); // before there are buffers that would have to grow
    this._renderer = new Renderer(canvas);
    this._listen();
  }

  /** @param {Performer[]} performers */
  show(performers) {
    this.performers = performers;
    this.look("", false);
  }

  /** The named view, "" where the camera has been moved. */
  get view() {
    return this._view;
  }

  /** Look from a named view, or from that which suits the content. @param {string} name @param {boolean} [slowly] */
  look(name, slowly = true) {
    const whole = this.performers.some(({ figure }) => figure.hasBody) && (name === "body" || !name);
    const [yaw, pitch] = VIEWS[name] ?? (whole ? VIEWS.body : [14, 2]);
    const to = new Camera([0, 0, 0], yaw, pitch).fit(this._subject(whole), this.aspect);
    this._view = name;
    if (slowly && !matchMedia("(prefers-reduced-motion: reduce)").matches) {
      this._flight = { from: this.camera.copy(), to, since: performance.now() };
    } else {
      this._flight = null;
      this.camera = to;
    }
    this.onchange();
  }

  get aspect() {
    return this.canvas.width / Math.max(this.canvas.height, 1);
  }

  /** Fit the canvas to its place on the page; return whether its size changed. */
  resize() {
    const scale = Math.min(devicePixelRatio || 1, MOST_PIXELS);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight].map((size) => Math.max(Math.round(size * scale), 1));
    if (this.canvas.width === width && this.canvas.height === height) return false;
    Object.assign(this.canvas, { width, height });
    if (!this._moved && this.performers.length) this.look(this._view, false);
    return true;
  }

  /** Draw all performers at a time. @param {number} time */
  draw(time) {
    if (this._flight) {
      const share = Math.min((performance.now() - this._flight.since) / (1000 * FADE), 1);
      this.camera = this._flight.from.between(this._flight.to, share * share * (3 - 2 * share));
      if (share < 1) this.onchange();
      else this._flight = null;
    }
    /** @type {import("./renderer.js").View} */
    const view = { figures: [], eyes: [], shadows: [], ground: false, background: this.background };
    this.performers.forEach(({ figure, timeline }, place) => {
      timeline.at(time, this._faps, this._baps);
      const posed = figure.pose(this._faps, this._baps);
      const aside = this._places()[place];
      for (const mesh of posed.figures) view.figures.push({ ...mesh, world: moved(mesh.world, aside) });
      for (const eye of posed.eyes) view.eyes.push({ ...eye, matrix: moved(eye.matrix, aside) });
      for (const [x, ...rest] of posed.shadows) view.shadows.push([x + aside, ...rest]);
      view.ground ||= posed.ground;
    });
    this._renderer.draw(view, this._following());
  }

  /** Return the camera, moved with the first performer if that one walks away. */
  _following() {
    const [first] = this.performers;
    if (!first?.figure.follows || !first.figure.bodySubject) return this.camera;
    const camera = this.camera.copy();
    const { centre } = first.figure.bodySubject;
    camera.target[0] += first.figure.root[0] - centre[0];
    camera.target[2] += first.figure.root[2] - centre[2];
    return camera;
  }

  /** Return where each performer is on the screen, as shares of its width from the left. */
  labels() {
    const matrix = this.camera.matrix(this.aspect);
    return this._places().map((x) => {
      const [y, z] = [this.camera.target[1], this.camera.target[2]];
      const across = matrix[0] * x + matrix[4] * y + matrix[8] * z + matrix[12];
      const depth = matrix[3] * x + matrix[7] * y + matrix[11] * z + matrix[15];
      return 0.5 + (0.5 * across) / depth;
    });
  }

  /** Return x of each performer, metres. */
  _places() {
    const widths = this.performers.map(({ figure }) => 2 * (figure.bodySubject ?? figure.subject).halfWidth);
    const step = Math.max(0, ...widths) * (1 + GAP);
    return this.performers.map((_, place) => (place - (this.performers.length - 1) / 2) * step);
  }

  /** Return what the camera is to see: all performers, or their heads. @param {boolean} whole @returns {import("./camera.js").Subject} */
  _subject(whole) {
    const boxes = this.performers.map(({ figure }) => (whole && figure.bodySubject) || figure.subject);
    if (!boxes.length) return { centre: [0, 0, 0], halfHeight: 0.2, halfWidth: 0.2 };
    const places = this._places();
    const edges = boxes.flatMap(({ centre, halfWidth }, k) => [centre[0] + places[k] - halfWidth, centre[0] + places[k] + halfWidth]);
    const [left, right] = [Math.min(...edges), Math.max(...edges)];
    const low = Math.min(...boxes.map(({ centre, halfHeight }) => centre[1] - halfHeight));
    const high = Math.max(...boxes.map(({ centre, halfHeight }) => centre[1] + halfHeight));
    return {
      centre: [(left + right) / 2, (low + high) / 2, boxes[0].centre[2]],
      halfHeight: (high - low) / 2,
      halfWidth: (right - left) / 2,
      halfDepth: Math.max(...boxes.map(({ halfDepth }) => halfDepth ?? 0)),
    };
  }

  get _moved() {
    return this._view === "moved";
  }

  _listen() {
    const { canvas } = this;
    /** @type {Map<number, PointerEvent>} */
    const pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, event);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const [x, y] = [event.clientX - before.clientX, event.clientY - before.clientY];
      const height = Math.max(canvas.clientHeight, 1);
      const others = [...pointers.values()].filter(({ pointerId }) => pointerId !== event.pointerId);
      pointers.set(event.pointerId, event);
      this._flight = null;
      if (others.length) {
        const apart = (/** @type {PointerEvent} */ finger) => Math.hypot(finger.clientX - others[0].clientX, finger.clientY - others[0].clientY);
        this.camera.zoom(clamped(apart(before) / Math.max(apart(event), 1), 0.5, 2));
        this.camera.pan(-x / height / 2, y / height / 2);
      } else if (event.buttons & 6 || event.shiftKey) this.camera.pan(-x / height, y / height);
      else this.camera.orbit(-x * TURN, y * TURN);
      this._view = "moved";
      this.onchange();
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => pointers.delete(/** @type {PointerEvent} */ (event).pointerId));
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this._flight = null;
      this.camera.zoom(Math.exp(clamped(event.deltaY, -100, 100) * 0.0015));
      this._view = "moved";
      this.onchange();
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", () => this.look(""));
  }
}

/** @param {import("../figure/matrices.js").Matrix} matrix @param {number} aside */
function moved(matrix, aside) {
  const result = Float64Array.from(matrix);
  result[12] += aside;
  return result;
}
