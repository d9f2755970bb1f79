/** Draws figures with WebGL 2 and the shaders of the desktop player, so that both show the same. */
import castFragment from "../../gl/shaders/shadow.frag";
import castVertex from "../../gl/shaders/shadow.vert";
import eyeFragment from "../../gl/shaders/eye.frag";
import eyeVertex from "../../gl/shaders/eye.vert";
import faceFragment from "../../gl/shaders/face.frag";
import faceVertex from "../../gl/shaders/face.vert";
import lighting from "../../gl/shaders/lighting.glsl";
import studioFragment from "../../gl/shaders/studio.frag";
import studioVertex from "../../gl/shaders/studio.vert";
import { IDENTITY, invert, rotationOf } from "../figure/matrices.js";

/**
 * A part of a figure: its triangles are indices `first` to `first + count` of the figure's; the rest as of `FaceShape` of
 * the desktop player.
 * @typedef {{
 *   first: number, count: number, picture: ImageBitmap | null, opaque: boolean, scatter: number, folds: boolean, twoSided: boolean,
 *   closed: boolean, hairs: boolean, smooth: boolean, alpha: string, opacity: number, cutoff: number, wrinkled: boolean,
 *   fine: number[],
 * }} Part
 *
 * What does not change of a figure of V vertices. colours: linear light and gloss, (V, 4). across: of hairs, (V, 8).
 * relief: that of the skin, and the metres after which it repeats.
 * @typedef {{
 *   count: number, triangles: Uint32Array, parts: Part[], colours: Float32Array, texcoords: Float32Array | null,
 *   across: Float32Array | null, wrinkles: import("../figure/wrinkles.js").Wrinkles | null,
 *   relief: {picture: ImageBitmap, metres: number} | null,
 * }} Shape
 *
 * A figure in a pose. light: (V, 4), key light, sky, through the skin, rim light. world: where it stands. wrinkles:
 * strengths on the left and the right, four each, or null. limbs: those that keep light from it, as in face.vert, or null.
 * @typedef {{
 *   shape: Shape, positions: Float32Array, normals: Float32Array, light: Float32Array, world: import("../figure/matrices.js").Matrix,
 *   wrinkles: Float32Array | null, limbs: Float32Array | null,
 * }} Posed
 *
 * An eyeball. matrix: from its own frame, of radius 1 and looking along +z, into the world. iris, pupil: radii. lids: (4, 3).
 * axes: of the head, (3, 3), column after column.
 * @typedef {{
 *   matrix: import("../figure/matrices.js").Matrix, iris: number, pupil: number, lids: Float32Array | number[], axes: number[],
 * }} Eye
 *
 * @typedef {{
 *   figures: Posed[], eyes: Eye[], shadows: number[][], ground: boolean, background: number[] | null,
 * }} View
 */

const ATTRIBUTES = [
  "in_position", "in_normal", "in_light", "in_colour", "in_texture", "in_wrinkle", "in_across", "in_along",
];
/** Pixels of blended parts with at least this opacity are drawn first, as opaque, then the others. */
const CORE_OPACITY = 0.9;
const TINT = [0.075, 0.105, 0.1];
const EYE_STEPS = 32;
const MIN_WRINKLE = 0.01; // strength from which wrinkles are drawn
const MIN_RELIEF = 50; // pixels that the relief is wide where it is drawn
const SAMPLED_VERTICES = 24; // of which the nearest says how near a figure is
const UNITS = Object.entries({ picture: 0, relief: 1, wrinkle_map: 2 });
/** Options of the programs that the built-in figures need: begun while the figure is still unpacked. */
const USUAL = [["SMOOTH"], ["SMOOTH", "HAIRS"], ["SMOOTH", "TEXTURED"]];

/** Draws views on a canvas. Throws an error where there is no WebGL 2. */
export class Renderer {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true });
    if (!gl) {
      throw new Error("this browser has no WebGL 2; switch on hardware acceleration, or use a newer browser");
    }
    this._gl = gl;
    /** @type {Map<string, Program>} */
    this._programs = new Map();
    /** @type {Map<Shape, Buffers>} */
    this._shapes = new Map();
    /** @type {Map<object, WebGLTexture>} */
    this._textures = new Map();
    this._sphere = sphereOf(gl);
    this._square = arrayOf(gl, [-1, -1, 1, -1, -1, 1, 1, 1]);
    this._triangle = arrayOf(gl, [-1, -1, 3, -1, -1, 3]);
    this._eye = [0, 0, 0];
    this._camera = /** @type {import("../figure/matrices.js").Matrix} */ (IDENTITY);
    this._pixel = 1;
    this._program("studio", studioVertex, studioFragment);
    this._program("eye", eyeVertex, eyeFragment);
    for (const options of USUAL) this._program("face", faceVertex, faceFragment, options);
  }

  /** @param {View} view @param {import("./camera.js").Camera} camera */
  draw(view, camera) {
    const gl = this._gl;
    const { width, height } = gl.canvas;
    this._eye = camera.eye;
    this._camera = camera.matrix(width / Math.max(height, 1));
    this._pixel = camera.pixel(height);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.DEPTH_TEST);
    const [red, green, blue, alpha] = view.background ?? [0.2, 0.2, 0.2, 1];
    gl.clearColor(red * alpha, green * alpha, blue * alpha, alpha);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!view.background) this._drawStudio(view, camera);
    if (view.ground) this._drawShadows(view.shadows);
    gl.enable(gl.DEPTH_TEST);
    for (const eye of view.eyes) this._drawEye(eye);
    this._drawFigures(view.figures);
  }

  /** Free what belongs to figures that are no longer shown. @param {Shape[]} shown */
  _keep(shown) {
    for (const [shape, buffers] of this._shapes) {
      if (shown.includes(shape)) continue;
      buffers.delete();
      this._shapes.delete(shape);
      const { wrinkles } = shape;
      if (!wrinkles) continue;
      this._gl.deleteTexture(this._textures.get(wrinkles) ?? null);
      this._textures.delete(wrinkles);
    }
  }

  /** @param {View} view @param {import("./camera.js").Camera} camera */
  _drawStudio(view, camera) {
    const program = this._use("studio", studioVertex, studioFragment);
    program.matrix("unproject", invert(this._camera));
    program.set("ground", Number(view.ground));
    program.set("centre", [camera.target[0], camera.target[2]]);
    program.set("size", [this._gl.drawingBufferWidth, this._gl.drawingBufferHeight]);
    this._gl.bindVertexArray(this._triangle);
    this._gl.drawArrays(this._gl.TRIANGLES, 0, 3);
  }

  /** @param {number[][]} shadows x, z, radius and darkness of each */
  _drawShadows(shadows) {
    const gl = this._gl;
    const program = this._use("shadow", castVertex, castFragment);
    blend(gl);
    gl.bindVertexArray(this._square);
    for (const shadow of shadows) {
      gl.vertexAttrib4fv(program.location("in_blob"), shadow);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
    gl.disable(gl.BLEND);
  }

  /** @param {Eye} eye */
  _drawEye(eye) {
    const gl = this._gl;
    const program = this._use("eye", eyeVertex, eyeFragment);
    program.matrix("world", eye.matrix);
    program.set("iris", eye.iris);
    program.set("pupil", eye.pupil);
    program.set("lids", eye.lids);
    program.matrix("head", eye.axes);
    const size = Math.max(Math.hypot(eye.matrix[0], eye.matrix[1], eye.matrix[2]), 1e-9);
    program.matrix("ball", rotationOf(eye.matrix).map((value) => value / size));
    program.set("tint", TINT);
    gl.bindVertexArray(this._sphere.array);
    gl.drawElements(gl.TRIANGLES, this._sphere.count, gl.UNSIGNED_SHORT, 0);
  }

  /** @param {Posed[]} figures */
  _drawFigures(figures) {
    const gl = this._gl;
    this._keep(figures.map(({ shape }) => shape));
    for (const figure of figures) {
      const buffers = this._buffers(figure.shape);
      buffers.write(figure);
      if (buffers.written === 2) this._prepareWrinkles(figure.shape);
    }
    const all = figures.flatMap((figure) => figure.shape.parts.map((part) => /** @type {[Posed, Part]} */ ([figure, part])));
    for (const [figure, part] of all) if (!seeThrough(part)) this._drawPart(figure, part);
    const transparent = all.filter(([, part]) => seeThrough(part));
    for (const [figure, part] of transparent) if (part.alpha === "blend") this._drawPart(figure, part, true);
    blend(gl);
    gl.depthMask(false);
    for (const [figure, part] of transparent) this._drawPart(figure, part);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** Make what wrinkles need, behind the first picture: it would make the first wrinkles late. @param {Shape} shape */
  _prepareWrinkles(shape) {
    if (!shape.wrinkles) return;
    this._bind(2, shape.wrinkles, ({ map }) => map, this._gl.CLAMP_TO_EDGE);
    for (const part of shape.parts.filter(({ wrinkled }) => wrinkled)) {
      this._program("face", faceVertex, faceFragment, optionsOf(part, { wrinkled: true })).use();
    }
  }

  /** @param {Posed} figure @param {Part} part @param {boolean} [core] only pixels that are nearly opaque */
  _drawPart(figure, part, core = false) {
    const gl = this._gl;
    const { shape, wrinkles, limbs } = figure;
    const wrinkled = part.wrinkled && wrinkles !== null && Math.max(...wrinkles) >= MIN_WRINKLE;
    const fine = part.fine[0] > 0 && shape.relief !== null && shape.relief.metres >= MIN_RELIEF * this._pixel * this._distance(figure);
    const options = optionsOf(part, { limbs: limbs !== null, wrinkled, fine, core });
    const program = this._use("face", faceVertex, faceFragment, options);
    program.matrix("world", figure.world);
    program.set("scatter", part.scatter);
    program.set("two_sided", Number(part.twoSided));
    program.set("opacity", part.opacity);
    program.set("cut", core ? CORE_OPACITY : part.cutoff);
    if (limbs) program.set("limbs", limbs);
    if (part.picture) this._bind(0, part.picture, rootsOf);
    if (fine && shape.relief) {
      program.set("fine", part.fine);
      this._bind(1, shape.relief.picture, (picture) => picture);
    }
    if (wrinkled && shape.wrinkles) {
      program.set("wrinkles_left", wrinkles.subarray(0, 4));
      program.set("wrinkles_right", wrinkles.subarray(4));
      program.set("wrinkle_window", shape.wrinkles.window);
      this._bind(2, shape.wrinkles, ({ map }) => map, gl.CLAMP_TO_EDGE);
    }
    if (part.closed) gl.enable(gl.CULL_FACE);
    gl.bindVertexArray(this._buffers(figure.shape).array);
    gl.drawElements(gl.TRIANGLES, part.count, gl.UNSIGNED_INT, 4 * part.first);
    gl.disable(gl.CULL_FACE);
  }

  /** @param {Shape} shape */
  _buffers(shape) {
    let buffers = this._shapes.get(shape);
    if (!buffers) this._shapes.set(shape, (buffers = new Buffers(this._gl, shape)));
    return buffers;
  }

  /** Return the distance from the eye to a figure. @param {Posed} figure */
  _distance({ positions, world }) {
    let least = Infinity;
    const step = 3 * Math.max(Math.floor(positions.length / 3 / SAMPLED_VERTICES), 1);
    for (let at = 0; at < positions.length; at += step) {
      least = Math.min(least, Math.hypot(...this._eye.map((place, k) => positions[at + k] + world[12 + k] - place)));
    }
    return least;
  }

  /**
   * Use a texture, made of pixels the first time.
   * @template {object} Key @param {number} unit @param {Key} key @param {(key: Key) => Pixels} pixelsOf @param {number} [wrap]
   */
  _bind(unit, key, pixelsOf, wrap) {
    const gl = this._gl;
    let texture = this._textures.get(key);
    gl.activeTexture(gl.TEXTURE0 + unit);
    if (!texture) this._textures.set(key, (texture = textureOf(gl, pixelsOf(key), wrap)));
    gl.bindTexture(gl.TEXTURE_2D, texture);
  }

  /** Return a program in use, with its camera set. @param {string} name @param {string} vertex @param {string} fragment @param {string[]} options */
  _use(name, vertex, fragment, options = []) {
    const program = this._program(name, vertex, fragment, options);
    program.use();
    program.set("eye", this._eye);
    program.matrix("camera", this._camera);
    program.set("pixel", this._pixel);
    return program;
  }

  /** Return a program, which the driver may still be compiling. @param {string} name @param {string} vertex @param {string} fragment @param {string[]} [options] */
  _program(name, vertex, fragment, options = []) {
    const key = [name, ...options].join(" ");
    let program = this._programs.get(key);
    if (!program) this._programs.set(key, (program = new Program(this._gl, vertex, fragment, options)));
    return program;
  }
}

/** Return the options of the program for a part. @param {Part} part @param {{limbs?: boolean, wrinkled?: boolean, fine?: boolean, core?: boolean}} state */
function optionsOf(part, { limbs = false, wrinkled = false, fine = false, core = false }) {
  return Object.entries({
    SMOOTH: part.smooth,
    HAIRS: part.hairs,
    LIMBS: limbs,
    FOLDS: limbs && part.folds && part.picture,
    TEXTURED: part.picture,
    WRINKLED: wrinkled,
    FINE: fine,
    SOLID: part.alpha === "opaque",
    CUT: part.alpha === "mask" || core,
    VEIL: part.alpha === "blend",
  }).flatMap(([name, used]) => (used ? [name] : []));
}

/** @param {Part} part */
function seeThrough(part) {
  if (part.hairs) return true;
  const pictured = part.picture !== null && !part.opaque;
  return part.alpha === "auto" ? pictured : part.alpha === "blend" && (pictured || part.opacity < 1);
}

/** @param {WebGL2RenderingContext} gl */
function blend(gl) {
  gl.enable(gl.BLEND);
  gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE);
}

/** A compiled program and the places of its uniforms. */
class Program {
  /** @param {WebGL2RenderingContext} gl @param {string} vertex @param {string} fragment @param {string[]} options */
  constructor(gl, vertex, fragment, options) {
    this._gl = gl;
    this.program = /** @type {WebGLProgram} */ (gl.createProgram());
    for (const [kind, text] of /** @type {[number, string][]} */ ([[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]])) {
      const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
      gl.shaderSource(shader, translated(text, options));
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    ATTRIBUTES.forEach((name, place) => gl.bindAttribLocation(this.program, place, name));
    gl.bindAttribLocation(this.program, 0, "in_corner");
    gl.linkProgram(this.program);
    /** @type {Map<string, {place: WebGLUniformLocation, type: number}> | null} */
    this._uniforms = null;
  }

  /** Use it from now on; the first time this waits until it is compiled. */
  use() {
    const gl = this._gl;
    gl.useProgram(this.program);
    if (this._uniforms) return;
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = (gl.getAttachedShaders(this.program) ?? []).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`the graphics driver refuses a shader: ${[gl.getProgramInfoLog(this.program), ...logs].join(" ")}`);
    }
    this._uniforms = new Map();
    for (const [name, unit] of UNITS) gl.uniform1i(gl.getUniformLocation(this.program, name), unit);
    const count = gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS);
    for (let k = 0; k < count; k += 1) {
      const { name, type } = /** @type {WebGLActiveInfo} */ (gl.getActiveUniform(this.program, k));
      const place = gl.getUniformLocation(this.program, name);
      if (place) this._uniforms.set(name.replace("[0]", ""), { place, type });
    }
  }

  /** @param {string} name */
  location(name) {
    return this._gl.getAttribLocation(this.program, name);
  }

  /** Set a uniform, if the program has it: a number or vectors. @param {string} name @param {number | ArrayLike<number>} value */
  set(name, value) {
    const [gl, uniform] = [this._gl, this._uniforms?.get(name)];
    if (!uniform) return;
    const values = typeof value === "number" ? [value] : Float32Array.from(value);
    if (uniform.type === gl.FLOAT) gl.uniform1fv(uniform.place, values);
    else if (uniform.type === gl.FLOAT_VEC2) gl.uniform2fv(uniform.place, values);
    else if (uniform.type === gl.FLOAT_VEC3) gl.uniform3fv(uniform.place, values);
    else gl.uniform4fv(uniform.place, values);
  }

  /** @param {string} name @param {import("../figure/matrices.js").Matrix} value 9 or 16 numbers */
  matrix(name, value) {
    const [gl, uniform] = [this._gl, this._uniforms?.get(name)];
    if (!uniform) return;
    const values = Float32Array.from(value);
    if (values.length === 9) gl.uniformMatrix3fv(uniform.place, false, values);
    else gl.uniformMatrix4fv(uniform.place, false, values);
  }
}

/** Return a shader of OpenGL 3.3 as one of WebGL 2. @param {string} text @param {string[]} options */
function translated(text, options) {
  const head = ["#version 300 es", "precision highp float;", "precision highp int;", ...options.map((name) => `#define ${name}`)];
  return text.replace("#version 330 core", head.join("\n")).replace("//include lighting.glsl", lighting);
}

/** The buffers of a figure. */
class Buffers {
  /** @param {WebGL2RenderingContext} gl @param {Shape} shape */
  constructor(gl, shape) {
    this._gl = gl;
    this.array = /** @type {WebGLVertexArrayObject} */ (gl.createVertexArray());
    gl.bindVertexArray(this.array);
    /** @type {WebGLBuffer[]} */
    this._all = [];
    const { count } = shape;
    this._moving = [3, 3, 4].map((size, place) => this._attribute(place, size, 4 * size * count));
    this._attribute(3, 4, shape.colours);
    this._attribute(4, 2, shape.texcoords);
    this._attribute(5, 2, shape.wrinkles?.places ?? null);
    if (shape.across) {
      const buffer = this._attribute(6, 4, shape.across, 32);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(7);
      gl.vertexAttribPointer(7, 4, gl.FLOAT, false, 32, 16);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this._buffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, shape.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.written = 0;
  }

  /** Write what moves. @param {Posed} figure */
  write(figure) {
    const gl = this._gl;
    this.written += 1;
    [figure.positions, figure.normals, figure.light].forEach((values, k) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this._moving[k]);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, values);
    });
  }

  delete() {
    for (const buffer of this._all) this._gl.deleteBuffer(buffer);
    this._gl.deleteVertexArray(this.array);
  }

  _buffer() {
    const buffer = /** @type {WebGLBuffer} */ (this._gl.createBuffer());
    this._all.push(buffer);
    return buffer;
  }

  /**
   * Return a buffer for an attribute; content: its values, a number of bytes to reserve, or null for none.
   * @param {number} place @param {number} size @param {Float32Array | number | null} content @param {number} [stride]
   */
  _attribute(place, size, content, stride = 0) {
    const gl = this._gl;
    const buffer = this._buffer();
    if (content === null) return buffer;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    if (typeof content === "number") gl.bufferData(gl.ARRAY_BUFFER, content, gl.DYNAMIC_DRAW);
    else gl.bufferData(gl.ARRAY_BUFFER, content, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, 0);
    return buffer;
  }
}

/**
 * A picture, or its numbers.
 * @typedef {ImageBitmap | {width: number, height: number, data: Uint8Array}} Pixels
 */

/** @param {WebGL2RenderingContext} gl @param {Pixels} pixels @param {number} [wrap] */
function textureOf(gl, pixels, wrap = gl.REPEAT) {
  const texture = /** @type {WebGLTexture} */ (gl.createTexture());
  gl.bindTexture(gl.TEXTURE_2D, texture);
  if ("data" in pixels) gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, pixels.width, pixels.height, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels.data);
  else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  gl.generateMipmap(gl.TEXTURE_2D);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap);
  return texture;
}

/** Return a picture as square roots of linear light, multiplied by alpha, as the shaders take it. @param {ImageBitmap} picture */
function rootsOf(picture) {
  const canvas = new OffscreenCanvas(picture.width, picture.height);
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  context.drawImage(picture, 0, 0);
  const pixels = new Uint8Array(context.getImageData(0, 0, picture.width, picture.height).data.buffer);
  const roots = Uint8Array.from({ length: 256 }, (_, value) => Math.round(255 * Math.sqrt(linear(value / 255))));
  for (let k = 0; k < pixels.length; k += 4) {
    const alpha = pixels[k + 3] / 255;
    pixels[k] = roots[pixels[k]] * alpha;
    pixels[k + 1] = roots[pixels[k + 1]] * alpha;
    pixels[k + 2] = roots[pixels[k + 2]] * alpha;
  }
  return { width: picture.width, height: picture.height, data: pixels };
}

/** Return linear light of a value in sRGB, both 0..1. @param {number} value */
function linear(value) {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

/** @param {WebGL2RenderingContext} gl @param {number[]} corners x and y */
function arrayOf(gl, corners) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
  gl.bindVertexArray(null);
  return array;
}

/** Return a sphere of radius 1. @param {WebGL2RenderingContext} gl */
function sphereOf(gl) {
  const [points, triangles] = [/** @type {number[]} */ ([]), /** @type {number[]} */ ([])];
  for (let ring = 0; ring <= EYE_STEPS; ring += 1) {
    const down = (Math.PI * ring) / EYE_STEPS;
    for (let step = 0; step <= EYE_STEPS; step += 1) {
      const round = (2 * Math.PI * step) / EYE_STEPS;
      points.push(Math.sin(down) * Math.cos(round), Math.sin(down) * Math.sin(round), Math.cos(down));
      const at = ring * (EYE_STEPS + 1) + step;
      if (ring < EYE_STEPS && step < EYE_STEPS) triangles.push(at, at + EYE_STEPS + 1, at + 1, at + 1, at + EYE_STEPS + 1, at + EYE_STEPS + 2);
    }
  }
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points), gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(triangles), gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return { array, count: triangles.length };
}
