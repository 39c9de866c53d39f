// The page's beginning: which of its kinds it is stands in the page itself.
import { Film } from "./film.js";
import { Live } from "./live.js";
import { Playback } from "./playback.js";

const KINDS = { live: Live, playback: Playback, film: Film };
const boot = JSON.parse(document.getElementById("boot").textContent);
document.body.classList.add(boot.kind);
window.tvist = new KINDS[boot.kind](boot);
