// Everything shown here was announced by others: it is put into the page as text, never as HTML.
const EVERY_MS = 10_000;
const message = document.querySelector("#message");
const table = document.querySelector("table");
const wall = document.querySelector("#wall");
const MOST_FRAMES = 16;
let listed = [];
document.querySelector("#origin").textContent = location.origin;
addEventListener("hashchange", () => showWall(listed));

/** The dashboard keeps its token on the shelf of the tab. */
function headers() {
  try {
    const token = sessionStorage.getItem("transientcam.token");
    return token ? { Authorization: `Bearer ${token}` } : {};
  } catch {
    return {};
  }
}

function cell(content) {
  const found = document.createElement("td");
  found.append(content);
  return found;
}

function link(url) {
  const found = document.createElement("a");
  if (/^https?:/.test(url)) found.href = url;
  found.rel = "noreferrer noopener";
  found.textContent = url;
  return found;
}

function row(camera) {
  const found = document.createElement("tr");
  const seen = camera.seen_s < 5 ? "now" : `${Math.round(camera.seen_s)} s ago`;
  const state = camera.state || "not announced";
  found.append(
    ...[camera.name, link(camera.url), camera.model, camera.serial, state, seen].map(cell),
  );
  found.dataset.state = camera.state;
  return found;
}

/** The pages of all cameras, in frames that can't lead this page away; they stay while the list is the same. */
function showWall(cameras) {
  const view = location.hash.slice(1);
  const urls = cameras.map(({ url }) => url).filter((url) => view && /^https?:/.test(url)).slice(0, MOST_FRAMES);
  document.querySelector("#framing").hidden = urls.length === 0;
  if (wall.dataset.shown === [view, ...urls].join(" ")) return;
  wall.dataset.shown = [view, ...urls].join(" ");
  wall.replaceChildren(
    ...urls.map((url) => {
      const [figure, name, frame] = ["figure", "figcaption", "iframe"].map((each) => document.createElement(each));
      frame.title = name.textContent = cameras.find((each) => each.url === url).name;
      frame.sandbox = "allow-scripts allow-same-origin";
      frame.src = `${url.replace(/[?#].*|\/*$/g, "")}/#view=${encodeURIComponent(view)}&kiosk=on`;
      figure.append(name, frame);
      return figure;
    }),
  );
}

function summary({ cameras, left_out, reason }) {
  if (reason !== null) return reason;
  if (cameras.length === 0) return "No camera announces itself on this network.";
  const found = cameras.length === 1 ? "1 camera" : `${cameras.length} cameras`;
  return left_out === 0 ? `${found}.` : `${found}; ${left_out} more were announced and are not listed.`;
}

async function refresh() {
  try {
    const answer = await fetch("api/v1/cameras", { headers: headers() });
    const found = await answer.json();
    if (answer.status === 401) {
      message.textContent = "This service requires a token: enter it in the dashboard, and come back in this tab.";
    } else if (!answer.ok) {
      message.textContent = found.detail;
    } else {
      message.textContent = summary(found);
      table.tBodies[0].replaceChildren(...found.cameras.map(row));
      listed = found.cameras;
      showWall(listed);
    }
    table.hidden = !answer.ok || found.cameras.length === 0;
  } catch {
    message.textContent = "The service does not answer.";
  }
  setTimeout(refresh, EVERY_MS);
}

refresh();
