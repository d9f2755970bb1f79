/** A player for any page: `<fba-player src="hello.fba" model="head.fbam" controls>`. */
import { FBAPlayer } from "./page/element.js";
import { startPage } from "./page/page.js";

export { Decoder, FbaError, decode } from "./fba.js";
export { FBAPlayer };

if (!customElements.get("fba-player")) customElements.define("fba-player", FBAPlayer);
const content = document.getElementById("fba-content"); // of a page of `fba export` or `fba serve`
if (content) startPage(content.textContent ?? "");
