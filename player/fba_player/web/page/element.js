/** `<fba-player src="hello.fba" model="head.fbam" controls>`: a player for any page. */
import { FbaError, decode } from "../fba.js";
import { TEMPLATE, clockText, iconOf } from "./controls.js";
import { factsOf, planesOf } from "./facts.js";
import { handleKey } from "./keyboard.js";
import { Lanes, Track, curveOf, expressionsOf, liveliest, parameters, visemesOf } from "./lanes.js";
import { LiveStream } from "./live.js";
import { makeFigure, readModel } from "./model.js";
import { Playback, SPEEDS } from "./playback.js";
import { Stage } from "./stage.js";
import { LiveTimeline, Timeline, framesOf } from "./timeline.js";
import style from "./style.css";

/**
 * A stream to be shown. model: what `readModel` returned.
 * @typedef {{name: string, bytes: Uint8Array, bapSteps?: "iso" | "visage"}} Source
 * @typedef {import("./model.js").Model} Model
 */

const TOAST = 1600; // milliseconds
const CURVES = 3; // shown at first
const AFTERWARDS = 50; // milliseconds after which panels are filled: the first picture comes before
const LIVE_DELAY = 0.04; // seconds by which a live picture follows what has arrived, so that motion is smooth
const LIVE_SLACK = 0.3; // seconds by which frames may come early or late before the clock is set anew

export class FBAPlayer extends HTMLElement {
  static observedAttributes = ["src", "model", "audio", "loop", "muted", "controls", "view", "speed", "bap-steps"];

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open" });
    root.innerHTML = `<style>${style}</style>${TEMPLATE}`;
    /** @type {ShadowRoot} */
    this._root = root;
    this.playback = new Playback();
    this.planes = /** @type {import("./lanes.js").Planes | null} */ (null);
    /** What the last streams were put on. @type {Model | null} */
    this.model = null;
    this._error = /** @type {Error | null} */ (null);
    /** @type {import("./stage.js").Performer[]} */
    this._performers = [];
    /** Those of files; none of a live stream. @type {Timeline[]} */
    this._timelines = [];
    /** @type {Promise<Model> | null} */
    this._model = null;
    this._stage = /** @type {Stage | null} */ (null);
    this._track = new Track(this._canvas(".track canvas"), this);
    this._lanes = new Lanes(this._canvas(".lanes canvas"), this);
    this._content = { visemes: /** @type {import("./lanes.js").Stretch[]} */ ([]), expressions: /** @type {import("./lanes.js").Stretch[]} */ ([]), curves: /** @type {import("./lanes.js").Curve[]} */ ([]) };
    this._loading = 0;
    this._due = 0;
    this._toastTimer = 0;
    /** @type {{figure: ReturnType<typeof makeFigure> | null, timeline: LiveTimeline | null, since: number, lost: number, stream: LiveStream} | null} */
    this._live = null;
    this._listen();
  }

  connectedCallback() {
    this._sizes = new ResizeObserver(() => this._request());
    this._sizes.observe(this);
    this._showControls();
    if (this.hasAttribute("src") && !this._performers.length) void this._load();
    this._request();
  }

  disconnectedCallback() {
    this._sizes?.disconnect();
    this.pause();
    cancelAnimationFrame(this._due);
    this._due = 0;
  }

  /** @param {string} name @param {string | null} _before @param {string | null} value */
  attributeChangedCallback(name, _before, value) {
    if (name === "loop") this.playback.loop = value !== null;
    else if (name === "controls") this._showControls();
    else if (name === "muted" && this.playback.audio) this.playback.audio.muted = value !== null;
    else if (name === "view" && value) this._stage?.look(value);
    else if (name === "speed" && Number(value) > 0) this.playbackRate = Number(value);
    else if (name === "audio" && value) this.setAudio(value);
    else if (name === "src" && value && this.isConnected) void this._load();
    else if (name === "model") this._model = null;
    this._refresh();
  }

  // As of <video>.

  get src() {
    return this.getAttribute("src") ?? "";
  }

  set src(value) {
    this.setAttribute("src", value);
  }

  get currentTime() {
    return this.playback.time - this.playback.start;
  }

  set currentTime(value) {
    this.playback.seek(value + this.playback.start);
    this._changed("seeked");
    this.dispatchEvent(new Event("timeupdate"));
  }

  get duration() {
    if (this._live) return Infinity;
    return this._performers.length ? this.playback.end - this.playback.start : NaN;
  }

  get paused() {
    return !this.playback.playing;
  }

  get ended() {
    return this.paused && this._timelines.length > 0 && this.playback.time >= this.playback.end - 1e-6;
  }

  get playbackRate() {
    return this.playback.speed;
  }

  set playbackRate(value) {
    if (!(value > 0 && Number.isFinite(value))) throw new RangeError(`a playbackRate of ${value}: expected a number above 0`);
    this.playback.setSpeed(value);
    this._changed("ratechange");
  }

  get loop() {
    return this.playback.loop;
  }

  set loop(value) {
    this.toggleAttribute("loop", Boolean(value));
  }

  get muted() {
    return this.playback.audio?.muted ?? this.hasAttribute("muted");
  }

  set muted(value) {
    if (this.playback.audio) this.playback.audio.muted = Boolean(value);
    this._changed("volumechange");
  }

  get volume() {
    return this.playback.audio?.volume ?? 1;
  }

  set volume(value) {
    if (this.playback.audio) this.playback.audio.volume = value;
    this._changed("volumechange");
  }

  /** What went wrong, or null. */
  get error() {
    return this._error;
  }

  /** As `HTMLMediaElement.readyState`: 0 nothing, 4 everything. */
  get readyState() {
    return this._performers.length ? 4 : 0;
  }

  play() {
    if (this._live) this.playback.playing = true;
    else this.playback.play();
    if (this.playback.playing) this._changed("play");
    return Promise.resolve();
  }

  pause() {
    const { playing } = this.playback;
    this.playback.pause();
    if (playing) this._changed("pause");
  }

  // Of its own.

  /** Numbers of frames of the first performance. */
  get frames() {
    return this._timelines[0]?.frames.length ?? 0;
  }

  /** Number of the frame that is shown. */
  get frame() {
    return this._timelines[0]?.position(this.playback.time).frame ?? 0;
  }

  set frame(value) {
    const [timeline] = this._timelines;
    if (!timeline) return;
    this.playback.seek(timeline.timeOf(Math.min(Math.max(value, 0), timeline.frames.length - 1)));
    this._changed("seeked");
  }

  /** Name of the view: "front", "three-quarter", "profile", "body", "" as the content suggests. */
  get view() {
    return this._stage?.view ?? "";
  }

  set view(name) {
    this._stage?.look(name);
    this._request();
  }

  /** Whether motion between frames is smooth. */
  get smooth() {
    return this._performers.every(({ timeline }) => timeline.interpolate);
  }

  set smooth(value) {
    for (const { timeline } of this._performers) timeline.interpolate = value;
    this._request();
  }

  /** Seconds from and to of what is played, from the first frame; null for the whole. @returns {[number, number] | null} */
  get range() {
    const { part, start } = this.playback;
    return part && [part[0] - start, part[1] - start];
  }

  set range(value) {
    const { start, end } = this.playback;
    const [from, to] = value ? [Math.max(value[0] + start, start), Math.min(value[1] + start, end)] : [0, 0];
    this.playback.part = value && to > from ? [from, to] : null;
    this._refresh();
  }

  /** Show streams, side by side, on the model. @param {Source[]} sources @param {Model | Promise<Model>} model */
  async show(sources, model) {
    const loading = ++this._loading;
    this._live?.stream.close();
    this._live = null;
    try {
      this._makeStage(); // the graphics driver compiles while the model is unpacked
      const shown = await model;
      /** @type {(import("./stage.js").Performer & {timeline: Timeline})[]} */
      const performers = [];
      const warnings = [];
      for (const { name, bytes, bapSteps } of sources) {
        const animation = decoded(name, bytes, bapSteps);
        warnings.push(...animation.damage.map(({ error }) => `${name}: ${error.message}`));
        const frames = framesOf(animation);
        const { figure, resolver } = makeFigure(shown, frames.hasBody, frames.hasFace);
        const timeline = new Timeline(frames, resolver);
        figure.measure(timeline);
        performers.push({ name, figure, timeline });
      }
      if (loading !== this._loading) return;
      this.model = shown;
      this._setPerformers(performers, performers.map(({ timeline }) => timeline));
      this.planes = null;
      setTimeout(() => loading === this._loading && this._fill(sources), AFTERWARDS);
      this._say(warnings.length ? `${warnings.length === 1 ? "The stream is damaged" : `${warnings.length} places are damaged`}; what is right is shown.\n${warnings.slice(0, 5).join("\n")}` : "", true);
      this._changed("loadedmetadata");
      this.dispatchEvent(new Event("loadeddata"));
      if (this.hasAttribute("autoplay")) void this.play();
    } catch (error) {
      if (loading === this._loading) this._fail(error);
    }
  }

  /** Show a stream as it comes from `fba serve`. @param {string} url of a WebSocket @param {Model} model */
  showLive(url, model) {
    this._loading += 1;
    this._live?.stream.close();
    this.model = model;
    const live = {
      figure: /** @type {ReturnType<typeof makeFigure> | null} */ (null),
      timeline: /** @type {LiveTimeline | null} */ (null),
      since: NaN,
      lost: 0,
      stream: new LiveStream(url, {
        hello: (titles, number) => this._showStreams(titles, number),
        start: () => (live.timeline = null),
        frames: (frames) => this._receive(frames),
        lost: (planes) => this.toast(`${(live.lost += planes)} planes lost: this page or its connection is too slow`),
        end: () => this.toast("the stream has ended"),
        state: (state, seconds) => this._showState(state, seconds),
        error: (error) => this._fail(error),
      }),
    };
    this._live = live;
  }

  /** @param {import("../decoder/frames.js").StreamFrame[]} frames */
  _receive(frames) {
    const { _live: live, model } = this;
    if (!live || !model) return;
    const begins = !live.timeline;
    live.figure ??= makeFigure(model, frames.some(({ body }) => body), frames.some(({ face }) => face));
    live.timeline ??= new LiveTimeline(live.figure.resolver.copy());
    live.timeline.push(frames);
    const now = performance.now() / 1000;
    if (!(Math.abs(now - live.since - live.timeline.newest) < LIVE_SLACK)) live.since = now - live.timeline.newest;
    this.dispatchEvent(new CustomEvent("frames", { detail: frames.length }));
    if (!begins) return;
    const { figure } = live.figure;
    if (this._performers[0]?.figure === figure) this._performers[0].timeline = live.timeline;
    else this._setPerformers([{ name: "", figure, timeline: live.timeline }], []);
    this._say("");
    this.playback.playing = true;
    this._changed("loadedmetadata");
  }

  /** List the streams of the server, if there are several. @param {string[]} titles @param {number} number of the one that is shown */
  _showStreams(titles, number) {
    document.title = titles[number] ?? document.title;
    const links = titles.map((title, k) => Object.assign(document.createElement("a"), { href: `?n=${k}`, textContent: title }));
    links[number]?.setAttribute("aria-current", "page");
    this._find(".streams").replaceChildren(...(titles.length > 1 ? links : []));
  }

  /** @param {import("./live.js").State} state @param {number} seconds */
  _showState(state, seconds) {
    const texts = {
      connecting: "connecting ...",
      waiting: `the connection is lost; next try in ${Math.ceil(seconds)} s`,
      over: "the stream is over",
    };
    if (state in texts) this._say(texts[/** @type {keyof typeof texts} */ (state)], true);
    this.dispatchEvent(new CustomEvent("connection", { detail: state }));
  }

  /** @param {string} url of a sound that begins with the first frame @param {number} [offset] seconds by which it begins later */
  setAudio(url, offset = 0) {
    const audio = new Audio(url);
    audio.preload = "auto";
    audio.muted = this.hasAttribute("muted");
    this.playback.pause();
    this.playback.audio = audio;
    this.playback.audioOffset = offset;
    audio.addEventListener("error", () => this._say(`the sound cannot be played: ${audio.error?.message || "its format is unknown to this browser"}`, true));
    this._refresh();
  }

  /** Show a line for a moment. @param {string} text */
  toast(text) {
    const line = this._find(".toast");
    line.textContent = text;
    line.classList.add("on");
    clearTimeout(this._toastTimer);
    this._toastTimer = window.setTimeout(() => line.classList.remove("on"), TOAST);
  }

  /** Open or close a panel. @param {"lanes" | "facts" | "keys"} name @param {boolean} [open] */
  toggle(name, open) {
    const panel = this._find(`.${name}`);
    panel.hidden = !(open ?? panel.hidden);
    const control = this._find(`[data-do="${name === "lanes" ? "curves" : name}"]`);
    control.setAttribute("aria-pressed", String(!panel.hidden));
    control.setAttribute("aria-expanded", String(!panel.hidden));
    if (name === "lanes" && !panel.hidden && !this._content.curves.length) this._chooseCurves();
    this._request();
  }

  /** Add a curve. @param {string} text a name or number, "BAP 5" for a BAP */
  addCurve(text) {
    const sought = text.trim().toLowerCase();
    const all = parameters();
    const match = all.find(({ kind, number, name }) => [`${kind} ${number}`.toLowerCase(), `${kind} ${number} ${name}`.toLowerCase(), name.toLowerCase(), kind === "FAP" ? String(number) : ""].includes(sought)) ?? all.find(({ name }) => sought && name.includes(sought.replaceAll(" ", "_")));
    const frames = this._timelines[0]?.frames;
    if (!match || !frames) {
      this.toast(`no parameter "${text}"`);
      return;
    }
    const { curves } = this._content;
    if (!curves.some(({ parameter }) => parameter.name === match.name)) curves.unshift(curveOf(frames, match));
    this._request();
  }

  async _load() {
    const loading = ++this._loading;
    try {
      const name = this.src.split("/").pop() ?? this.src;
      const steps = /** @type {"iso" | "visage" | null} */ (this.getAttribute("bap-steps"));
      this._model ??= fetched(this.getAttribute("model") ?? new URL("head.fbam", import.meta.url).href).then((file) => readModel(file));
      const [bytes, model] = await Promise.all([fetched(this.src), this._model]);
      if (loading === this._loading) await this.show([{ name, bytes, ...(steps ? { bapSteps: steps } : {}) }], model);
    } catch (error) {
      if (loading === this._loading) this._fail(error);
    }
  }

  /** @param {import("./stage.js").Performer[]} performers @param {Timeline[]} timelines theirs, none of a live stream */
  _setPerformers(performers, timelines) {
    this._error = null;
    this.pause();
    this._performers = performers;
    this._timelines = timelines;
    const stage = this._makeStage();
    stage.resize();
    stage.show(performers);
    if (this.getAttribute("view")) stage.look(this.getAttribute("view") ?? "", false);
    this._find(".track").hidden = !timelines.length;
    if (timelines.length) {
      this.playback.time = -Infinity;
      this.playback.span(Math.min(...timelines.map(({ start }) => start)), Math.max(...timelines.map(({ end }) => end)));
    }
    const names = this._find(".names");
    names.replaceChildren(...(performers.length > 1 ? performers.map(({ name }) => Object.assign(document.createElement("span"), { className: "name", textContent: name })) : []));
    this._refresh();
  }

  _makeStage() {
    if (!this._stage) {
      this._stage = new Stage(this._canvas(".stage canvas"));
      this._stage.onchange = () => this._request();
    }
    return this._stage;
  }

  /** Fill the panels. @param {Source[]} sources */
  _fill(sources) {
    const { frames } = this._timelines[0];
    const planes = sources.map(planesOf);
    this.planes = planes.length === 1 ? planes[0] : null;
    this._content = { visemes: visemesOf(frames), expressions: expressionsOf(frames), curves: [] };
    if (!this._find(".lanes").hidden) this._chooseCurves();
    const facts = this._find(".facts");
    facts.replaceChildren(...sources.flatMap((source, k) => factsOf(source, this._timelines[k], planes[k])));
    const list = this._find("#parameters");
    if (!list.children.length) {
      list.replaceChildren(...parameters().map(({ kind, number, name }) => Object.assign(document.createElement("option"), { value: `${kind} ${number} ${name}` })));
    }
    this._request();
  }

  _chooseCurves() {
    const frames = this._timelines[0]?.frames;
    if (frames) this._content.curves = liveliest(frames, CURVES).map((parameter) => curveOf(frames, parameter));
    this._request();
  }

  /** @param {string} text what the player says on itself, "" for nothing @param {boolean} [notice] rather than an error */
  _say(text, notice = false) {
    const message = this._find(".message");
    message.textContent = text;
    message.hidden = !text;
    message.classList.toggle("notice", notice);
    message.setAttribute("role", notice ? "status" : "alert");
    if (!text) return;
    const close = Object.assign(document.createElement("button"), { textContent: "×", type: "button" });
    close.setAttribute("aria-label", "close this message");
    close.addEventListener("click", () => (message.hidden = true));
    message.prepend(close);
  }

  /** @param {unknown} error */
  _fail(error) {
    this._error = error instanceof Error ? error : new Error(String(error));
    this._say(this._error.message);
    this._changed("error");
  }

  /** @param {string} event */
  _changed(event) {
    this._refresh();
    this.dispatchEvent(new Event(event));
  }

  _showControls() {
    this._find(".bar").hidden = !this.hasAttribute("controls");
    this._request();
  }

  /** Bring the controls in line with the state, and draw. */
  _refresh() {
    const { playback } = this;
    const play = this._find('[data-do="play"]');
    if (play.dataset.shown !== String(playback.playing)) {
      play.dataset.shown = String(playback.playing);
      play.innerHTML = iconOf(playback.playing ? "pause" : "play");
      play.setAttribute("aria-label", playback.playing ? "pause" : "play");
      play.title = playback.playing ? "pause (Space)" : "play (Space)";
    }
    this._find('[data-do="loop"]').setAttribute("aria-pressed", String(playback.loop));
    const sound = this._find('[data-do="sound"]');
    sound.hidden = !playback.audio;
    sound.setAttribute("aria-pressed", String(!this.muted));
    sound.innerHTML = iconOf(this.muted ? "silent" : "sound");
    const speed = /** @type {HTMLSelectElement} */ (this._find('[data-do="speed"]'));
    if (SPEEDS.includes(playback.speed)) speed.value = String(playback.speed);
    for (const name of ["back", "ahead", "loop", "curves", "facts"]) /** @type {HTMLButtonElement} */ (this._find(`[data-do="${name}"]`)).disabled = !this._timelines.length;
    this._request();
  }

  /** Draw at the next chance. */
  _request() {
    if (!this._due && this.isConnected) this._due = requestAnimationFrame(() => this._draw());
  }

  _draw() {
    this._due = 0;
    const { playback } = this;
    if (this._live) {
      const { since, timeline } = this._live;
      if (playback.playing && timeline) playback.time = Math.min(performance.now() / 1000 - since - LIVE_DELAY, timeline.newest);
    } else if (playback.advance()) this._changed("ended");
    if (this._stage && this._performers.length) {
      this._stage.resize();
      try {
        this._stage.draw(playback.time);
      } catch (error) {
        playback.pause();
        this._fail(error);
      }
      const shares = this._stage.labels();
      [...this._find(".names").children].forEach((label, k) => (/** @type {HTMLElement} */ (label).style.left = `${100 * shares[k]}%`));
    }
    if (this.hasAttribute("controls")) this._drawControls();
    if (playback.playing) {
      this._request();
      this.dispatchEvent(new Event("timeupdate"));
    }
  }

  _drawControls() {
    const { playback } = this;
    if (this._live) {
      this._find(".now").textContent = clockText(playback.time);
      this._find(".all").textContent = playback.playing ? "live" : "paused";
      return;
    }
    const span = { from: playback.start, to: playback.end };
    this._track.draw(this.planes, span, playback.part, playback.time);
    if (!this._find(".lanes").hidden) this._lanes.draw(this._content, span, playback.time);
    const seek = /** @type {HTMLInputElement} */ (this._find(".track input"));
    seek.max = String(Math.max(playback.end - playback.start, 1e-3));
    seek.value = String(this.currentTime);
    const frame = `frame ${this.frame} / ${this.frames - 1}`;
    seek.setAttribute("aria-valuetext", `${clockText(this.currentTime)} of ${clockText(this.duration || 0)}, ${frame}`);
    this._find(".now").textContent = clockText(this.currentTime);
    this._find(".all").textContent = this._performers.length ? `/ ${clockText(this.duration)} · ${frame}` : "";
  }

  _listen() {
    const root = this._root;
    root.addEventListener("click", (event) => {
      const control = /** @type {HTMLElement} */ (event.target).closest("button[data-do]");
      if (control) this._do(/** @type {HTMLElement} */ (control).dataset.do ?? "");
    });
    root.addEventListener("change", (event) => {
      const control = /** @type {HTMLSelectElement} */ (event.target);
      if (control.dataset.do === "speed") this.playbackRate = Number(control.value);
      else if (control.dataset.do === "view") {
        this.view = control.value;
        control.value = "";
      } else if (control.matches(".lanes input") && control.value) {
        this.addCurve(control.value);
        control.value = "";
      }
    });
    const seek = /** @type {HTMLInputElement} */ (this._find(".track input"));
    seek.addEventListener("input", () => (this.currentTime = Number(seek.value)));
    this._canvas(".lanes canvas").addEventListener("pointerdown", (event) => {
      const { left, width } = this._canvas(".lanes canvas").getBoundingClientRect();
      this.currentTime = ((event.clientX - left) / width) * (this.duration || 0);
    });
    this._find(".player").addEventListener("keydown", (event) => {
      if (handleKey(this, /** @type {KeyboardEvent} */ (event))) event.preventDefault();
    });
    this.addEventListener("fullscreenchange", () => this._request());
    this.addEventListener("dragover", (event) => {
      event.preventDefault();
      this._find(".stage").classList.add("over");
    });
    this.addEventListener("dragleave", () => this._find(".stage").classList.remove("over"));
    this.addEventListener("drop", (event) => void this._drop(event));
  }

  /** @param {string} action of a button */
  _do(action) {
    if (action === "play") void (this.paused ? this.play() : this.pause());
    else if (action === "back" || action === "ahead") {
      this.pause();
      this.frame += action === "back" ? -1 : 1;
    } else if (action === "loop") this.loop = !this.loop;
    else if (action === "sound") this.muted = !this.muted;
    else if (action === "full") void this.toggleFullScreen();
    else if (action === "reset-curves") this._chooseCurves();
    else this.toggle(/** @type {"lanes" | "facts" | "keys"} */ (action === "curves" ? "lanes" : action));
  }

  /** Enter or leave the full screen. */
  async toggleFullScreen() {
    try {
      if (document.fullscreenElement) await document.exitFullscreen();
      else await this.requestFullscreen();
    } catch (error) {
      this.toast(`no full screen: ${/** @type {Error} */ (error).message}`);
    }
  }

  /** @param {DragEvent} event with a file */
  async _drop(event) {
    event.preventDefault();
    this._find(".stage").classList.remove("over");
    const [file] = event.dataTransfer?.files ?? [];
    if (!file) return;
    const bytes = new Uint8Array(await file.arrayBuffer());
    const model = this.model ?? (this._model ??= fetched(this.getAttribute("model") ?? "").then((file) => readModel(file)));
    this.playback.audio?.pause();
    this.playback.audio = null;
    await this.show([{ name: file.name, bytes }], model);
    if (!this._error) void this.play();
  }

  /** @param {string} selector @returns {HTMLElement} */
  _find(selector) {
    return /** @type {HTMLElement} */ (this._root.querySelector(selector));
  }

  /** @param {string} selector */
  _canvas(selector) {
    return /** @type {HTMLCanvasElement} */ (this._find(selector));
  }
}

/** Decode a stream: strictly, and where that fails, what is right of it. @param {string} name @param {Uint8Array} bytes @param {"iso" | "visage"} [bapSteps] */
function decoded(name, bytes, bapSteps) {
  const options = bapSteps ? { bapSteps } : {};
  try {
    try {
      return decode(bytes, options);
    } catch (error) {
      if (!(error instanceof FbaError) || error.kind !== "damage") throw error;
      return decode(bytes, { ...options, salvage: true });
    }
  } catch (error) {
    if (error instanceof FbaError) error.message = `${name}: ${error.message}`;
    throw error;
  }
}

/** @param {string} url */
async function fetched(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url}: ${answer.status} ${answer.statusText}; see that the file is there and that this page may read it`);
  return new Uint8Array(await answer.arrayBuffer());
}
