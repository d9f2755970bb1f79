/** A decoder of MPEG-4 Face and Body Animation streams (ISO/IEC 14496-2, FBA object), without dependencies. */
export { decode } from "./decoder/animation.js";
export { FbaError } from "./decoder/errors.js";
export { Decoder } from "./decoder/stream.js";

/** @typedef {import("./decoder/stream.js").Options} Options */
/** @typedef {import("./decoder/frames.js").Frame} Frame */
/** @typedef {import("./decoder/frames.js").StreamFrame} StreamFrame */
/** @typedef {import("./decoder/frames.js").FaceFrame} FaceFrame */
/** @typedef {import("./decoder/frames.js").BodyFrame} BodyFrame */
/** @typedef {import("./decoder/stream.js").Damage} Damage */
/** @typedef {import("./decoder/animation.js").Animation} Animation */
