/** A decoder of MPEG-4 Face and Body Animation streams (ISO/IEC 14496-2, FBA object), without dependencies. */
export { Animation, decode } from "./decoder/animation.js";
export { FbaError } from "./decoder/errors.js";
export { Decoder } from "./decoder/stream.js";
