// The page's entry point; the kind of page is in its boot data.
import { Film } from "./film.js";
import { Live } from "./live.js";
import { Playback } from "./playback.js";

const KINDS = { live: Live, playback: Playback, film: Film };
const boot = JSON.parse(document.getElementById("boot").textContent);
document.body.classList.add(boot.kind);
window.tvist = new KINDS[boot.kind](boot);
