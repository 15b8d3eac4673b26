"use strict";
// Zoom into the records of a report and read their values. Each record is drawn from the extremes of blocks of samples,
// so that no peak is lost at any zoom. Text enters the page as text alone.
(() => {
const COLOURS = ["#c2410c", "#8a929c", "#5b4a91", "#3f7d3a", "#e0a526", "#1b1f24"], MEASURED = "#7ba1c9", DRIVE = "#5b4a91", FAULT = "#b01030";
const FACTOR = 8, GAP = 5, LEFT = 66, RIGHT = 10, KEYS = {ArrowLeft: -1, ArrowRight: 1};

// Samples of a channel: variable-length numbers, zigzag, summed `order` times
function decoded(channel, count) {
  const bytes = atob(channel.data), out = new Float64Array(count);
  for (let i = 0, place = 0; i < count; i++) {
    let value = 0, scale = 1, byte;
    do {
      byte = bytes.charCodeAt(place++);
      value += (byte & 127) * scale;
      scale *= 128;
    } while (byte > 127);
    out[i] = value % 2 ? -(value + 1) / 2 : value / 2;
  }
  for (let k = 0; k < channel.order; k++) for (let i = 1; i < count; i++) out[i] += out[i - 1];
  for (let i = 0; i < count; i++) out[i] = channel.zero + channel.step * out[i];
  for (const [first, last] of channel.holes) out.fill(NaN, first, last);
  return out;
}

// Extremes of blocks of 1, 8, 64, .. samples; NaN for blocks without any value
function pyramid(values) {
  const levels = [{low: values, high: values}];
  while (levels[levels.length - 1].low.length > FACTOR) {
    const {low, high} = levels[levels.length - 1], count = Math.ceil(low.length / FACTOR);
    const next = {low: new Float64Array(count).fill(NaN), high: new Float64Array(count).fill(NaN)};
    for (let i = 0; i < low.length; i++) {
      const k = Math.floor(i / FACTOR);
      if (!(next.low[k] <= low[i])) next.low[k] = low[i] === low[i] ? low[i] : next.low[k];
      if (!(next.high[k] >= high[i])) next.high[k] = high[i] === high[i] ? high[i] : next.high[k];
    }
    levels.push(next);
  }
  return levels;
}

function opened(record) {
  if (record.open) return record.open;
  const n = record.count, [v, y, ...models] = record.channels.map(each => decoded(each, n)), [a, b] = record.line;
  const t = record.time ? decoded(record.time, n) : Float64Array.from({length: n}, (_, i) => record.first + i * record.spacing);
  const less = values => values.map((x, i) => x - a - b * v[i]);
  return record.open = {
    t, v, y, models, drive: pyramid(v),
    whole: [y, ...models].map(pyramid), bent: [y, ...models].map(x => pyramid(less(x))),
    errors: models.map(m => pyramid(y.map((x, i) => x - m[i]))),
  };
}

// Index of the first sample at or after a time
function place(t, time) {
  let low = 0, high = t.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle] < time) low = middle + 1; else high = middle;
  }
  return low;
}

function make(tag, parent, text, attributes) {
  const made = document.createElement(tag);
  if (text) made.textContent = text;
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  parent.append(made);
  return made;
}

// The last of several models is the one that the report is about
const colour = (k, names) => COLOURS[(names.length - 1 - k) % COLOURS.length];
const withUnit = (name, unit) => unit ? `${name} (${unit})` : name;
const digits = step => Math.min(12, Math.max(0, Math.ceil(-Math.log10(step))));
const plain = (value, step) => value === value ? value.toFixed(digits(step)) : "not compared";

function ticks(low, high, most) {
  const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(m => m * power >= rough), found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push([k * step, (k * step).toFixed(digits(step))]);
  return found;
}

function start(root) {
  const given = JSON.parse(root.dataset.viewer), [input, output] = given.units, [measured, difference] = given.words;
  let record = given.records[0], data = opened(record), from, to, cursor = 0;
  const [off, how] = root.children;
  off.remove();
  how.hidden = false;

  const bar = make("div", root, "", {class: "bar"});
  const choice = make("select", bar, "", {"aria-label": "record"});
  given.records.forEach((each, k) => make("option", choice, `${each.name} (${each.role})`, {value: k}));
  const button = (text, label, act) => make("button", bar, text, {type: "button", "aria-label": label, title: label})
    .addEventListener("click", () => { act(); draw(); });
  button("+", "zoom in", () => zoom(0.5));
  button("\u2212", "zoom out", () => zoom(2));
  button("\u25c0", "earlier", () => pan(-0.5));
  button("\u25b6", "later", () => pan(0.5));
  button("whole", "whole record", home);
  const label = make("label", bar), bent = make("input", label, "", {type: "checkbox", checked: ""});
  label.append(" deviation from the straight line");
  const legend = make("div", root, "", {class: "legend"});
  [[measured, MEASURED], ...given.models.map((name, k) => [name, colour(k, given.models)])].forEach(([name, ink]) =>
    make("span", legend, name).style.setProperty("--ink", ink));
  const area = make("div", root, "", {class: "plots"});
  const time = make("canvas", area, "", {
    class: "time", tabindex: "0", role: "application", "aria-roledescription": "zoomable plot",
    "aria-label": "Displacement, error and drive over time. Left and right arrows: to the next point; "
      + "with Shift: half a window; plus and minus: zoom; Home: whole record; End: last sample.",
  });
  const values = make("output", area, "", {"aria-live": "polite"});
  const loop = make("canvas", area, "", {class: "loop", role: "img", "aria-label": "The same window over the drive"});

  root.append(how);

  const span = () => [data.t[0], data.t[data.t.length - 1]];
  function home() { [from, to] = span(); }
  // The first sample that was compared
  function first() { cursor = Math.max(data.errors[0][0].low.findIndex(x => x === x), 0); }
  function look(a, b) {
    const [first, last] = span(), least = 4 * record.spacing, width = Math.min(Math.max(b - a, least), last - first);
    from = Math.min(Math.max((a + b - width) / 2, first), last - width);
    to = from + width;
  }
  function zoom(by, about) {
    const t = about === undefined ? data.t[cursor] : about, middle = t >= from && t <= to ? t : (from + to) / 2;
    look(middle - by * (middle - from), middle + by * (to - middle));
  }
  function pan(share) { look(from + share * (to - from), to + share * (to - from)); }
  function point(index) {
    cursor = Math.min(Math.max(index, 0), data.t.length - 1);
    const t = data.t[cursor], width = to - from;
    if (t < from || t > to) look(t - width / 2, t + width / 2);
  }
  // To the nearest sample
  function pointAt(t) {
    const k = place(data.t, t);
    point(k > 0 && (k === data.t.length || t - data.t[k - 1] < data.t[k] - t) ? k - 1 : k);
  }

  // The context of a canvas in CSS pixels, cleared
  function cleared(canvas) {
    const {clientWidth: w, clientHeight: h} = canvas, ratio = window.devicePixelRatio || 1, c = canvas.getContext("2d");
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.font = "12px system-ui, sans-serif";
    c.lineJoin = "bevel"; // mitred corners would stand out beyond the extremes
    return [c, w, h];
  }

  // Level, first and last block for a window and a number of pixels
  function blocks(levels, wide) {
    const a = Math.max(place(data.t, from) - 1, 0), b = Math.min(place(data.t, to) + 1, data.t.length);
    let k = 0;
    while (k + 1 < levels.length && FACTOR ** (k + 1) * wide <= b - a) k++;
    return [levels[k], Math.floor(a / FACTOR ** k), Math.ceil(b / FACTOR ** k), FACTOR ** k];
  }

  function extremes(all, wide) {
    let low = Infinity, high = -Infinity;
    for (const levels of all) {
      const [{low: l, high: h}, a, b] = blocks(levels, wide);
      for (let i = a; i < b; i++) { if (l[i] < low) low = l[i]; if (h[i] > high) high = h[i]; }
    }
    return [low, high];
  }

  function limits(all, wide) {
    let [low, high] = extremes(all, wide);
    if (!(low <= high)) [low, high] = [-1, 1];
    const margin = 0.06 * (high - low) || 0.5 * Math.abs(high) || 1;
    return [low - margin, high + margin];
  }

  // Limits of measured and models by the samples that were compared, if there are any
  function compared(shown, wide) {
    const [low, high] = extremes(shown.slice(1), wide), [under, over] = extremes(data.errors, wide);
    if (!(low <= high)) return limits(shown, wide);
    const a = low + Math.min(under, 0), b = high + Math.max(over, 0), margin = 0.04 * (b - a) || 1;
    return [a - margin, b + margin];
  }

  // Axes with ticks and a title; returns the maps to pixels
  function axes(c, [x0, x1, y0, y1], [low, high], [left, right], title, below) {
    const px = x => x0 + (x - left) / (right - left) * (x1 - x0), py = y => y1 - (y - low) / (high - low) * (y1 - y0);
    c.strokeStyle = "#e2e5e9";
    c.fillStyle = "#3d4650";
    c.lineWidth = 1;
    c.textAlign = "right";
    for (const [at, text] of ticks(low, high, Math.max(5, (y1 - y0) / 40))) {
      c.beginPath(); c.moveTo(x0, py(at)); c.lineTo(x1, py(at)); c.stroke();
      c.fillText(text, x0 - 5, py(at) + 4);
    }
    c.textAlign = "center";
    for (const [at, text] of ticks(left, right, Math.max(2, (x1 - x0) / 65))) {
      c.beginPath(); c.moveTo(px(at), y0); c.lineTo(px(at), y1); c.stroke();
      if (below) c.fillText(text, px(at), y1 + 15);
    }
    c.textAlign = "left";
    c.fillText(title, x0, y0 - 5);
    if (below) { c.textAlign = "right"; c.fillText(below, x1, y1 + 30); }
    return [px, py];
  }

  // A line through the extremes of blocks, broken where values are missing or time jumps
  function line(c, levels, px, py, wide, ink, width, dots) {
    const [{low, high}, a, b, size] = blocks(levels, wide);
    c.strokeStyle = c.fillStyle = ink;
    c.lineWidth = width;
    c.beginPath();
    let before = NaN;
    for (let i = a; i < b; i++) {
      const t = data.t[i * size];
      if (!(low[i] <= high[i])) { before = NaN; continue; }
      const x = px(t);
      if (t - before <= GAP * size * record.spacing) c.lineTo(x, py(low[i])); else c.moveTo(x, py(low[i]));
      if (low[i] !== high[i]) c.lineTo(x, py(high[i]));
      if (dots) c.fillRect(x - 2, py(low[i]) - 2, 4, 4);
      before = t;
    }
    c.stroke();
  }

  function draw() {
    const [c, w, h] = cleared(time), wide = w - LEFT - RIGHT, shown = bent.checked ? data.bent : data.whole;
    const names = given.models, room = h - 34, dots = (to - from) / record.spacing < wide / 8;
    const strips = [[0, 0.46], [0.46, 0.76], [0.76, 1]].map(([a, b]) => [LEFT, w - RIGHT, 18 + a * room, b * room - 4]);
    const what = bent.checked ? "displacement \u2212 line" : "displacement";
    const panels = [
      [withUnit(what, output), shown, [[MEASURED, 2.4], ...names.map((_, k) => [colour(k, names), 1.1])]],
      [withUnit(difference, output), data.errors, names.map((_, k) => [colour(k, names), 1.1])],
      [withUnit("drive", input), [data.drive], [[DRIVE, 1.2]]],
    ];
    panels.forEach(([title, all, styles], k) => {
      const box = strips[k], heights = k ? limits(all, wide) : compared(all, wide);
      const [px, py] = axes(c, box, heights, [from, to], title, k === 2 ? "time (s)" : "");
      c.save();
      c.beginPath(); c.rect(box[0], box[2], box[1] - box[0], box[3] - box[2]); c.clip();
      all.forEach((levels, j) => line(c, levels, px, py, wide, styles[j][0], styles[j][1], dots));
      if (k === 1 && given.noise) {
        c.setLineDash([5, 4]);
        c.strokeStyle = FAULT;
        for (const side of [-given.noise, given.noise]) { c.beginPath(); c.moveTo(box[0], py(side)); c.lineTo(box[1], py(side)); c.stroke(); }
        c.setLineDash([]);
      }
      c.strokeStyle = "#1b1f24";
      c.lineWidth = 0.8;
      c.beginPath(); c.moveTo(px(data.t[cursor]), box[2]); c.lineTo(px(data.t[cursor]), box[3]); c.stroke();
      c.restore();
    });
    drawLoop(what, shown);
    say();
  }

  // The window over the drive: the extremes of each block at the middle of its drive
  function drawLoop(what, shown) {
    const [c, w, h] = cleared(loop), box = [LEFT, w - RIGHT, 18, h - 34], wide = 2000;
    const sides = limits([data.drive], wide);
    const [px, py] = axes(c, box, compared(shown, wide), sides, withUnit(what, output), withUnit("drive", input));
    c.save();
    c.beginPath(); c.rect(box[0], box[2], box[1] - box[0], box[3] - box[2]); c.clip();
    shown.forEach((levels, j) => {
      const [drive, a, b, size] = blocks(data.drive, wide), [{low, high}] = blocks(levels, wide);
      c.strokeStyle = j ? colour(j - 1, given.models) : MEASURED;
      c.lineWidth = j ? 1.1 : 2.4;
      c.beginPath();
      let before = NaN;
      for (let i = a; i < b; i++) {
        const t = data.t[i * size], x = px((drive.low[i] + drive.high[i]) / 2);
        if (!(low[i] <= high[i])) { before = NaN; continue; }
        if (t - before <= GAP * size * record.spacing) c.lineTo(x, py(low[i])); else c.moveTo(x, py(low[i]));
        if (low[i] !== high[i]) c.lineTo(x, py(high[i]));
        before = t;
      }
      c.stroke();
    });
    c.restore();
  }

  function say() {
    const [v, y, ...models] = [data.v, data.y, ...data.models].map(x => x[cursor]), unit = x => x ? ` ${x}` : "";
    const steps = record.channels.map(each => each.step), said = [
      `time ${plain(data.t[cursor], record.tick)} s`, `drive ${plain(v, steps[0])}${unit(input)}`,
      `${measured} ${plain(y, steps[1])}${y === y ? unit(output) : ""}`,
    ];
    models.forEach((m, k) => said.push(m === m
      ? `${given.models[k]} ${plain(m, steps[k + 2])}${unit(output)}, ${difference} ${plain(y - m, steps[1])}${unit(output)}`
      : `${given.models[k]} not compared`));
    values.textContent = `${said.join("; ")}; window ${plain(from, record.tick)} to ${plain(to, record.tick)} s`;
  }

  const timeAt = event => {
    const box = time.getBoundingClientRect();
    return from + (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT) * (to - from);
  };
  time.addEventListener("keydown", event => {
    const key = event.key, shown = (to - from) / record.spacing, pixel = Math.max(1, Math.round(shown / 400));
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (key in KEYS && event.shiftKey) pan(0.5 * KEYS[key]);
    else if (key in KEYS) point(cursor + KEYS[key] * pixel);
    else if (key === "+" || key === "=" || key === "ArrowUp") zoom(0.5);
    else if (key === "-" || key === "_" || key === "ArrowDown") zoom(2);
    else if (key === "PageUp") pan(-1);
    else if (key === "PageDown") pan(1);
    else if (key === "Home") { home(); point(0); }
    else if (key === "End") point(data.t.length - 1);
    else return;
    event.preventDefault();
    draw();
  });
  time.addEventListener("wheel", event => {
    if (!event.ctrlKey && document.activeElement !== time) return;
    event.preventDefault();
    zoom(event.deltaY > 0 ? 1.25 : 0.8, timeAt(event));
    draw();
  }, {passive: false});
  time.addEventListener("dblclick", () => { home(); draw(); });

  // One pointer moves the window, two zoom it; a mouse without a button, or a tap, reads values
  const pointers = new Map();
  time.addEventListener("pointerdown", event => {
    pointers.set(event.pointerId, timeAt(event));
    pointAt(timeAt(event));
    draw();
  });
  addEventListener("pointermove", event => {
    if (!pointers.size && event.target === time && event.pointerType === "mouse") pointAt(Math.min(Math.max(timeAt(event), from), to));
    else if (pointers.size === 1 && pointers.has(event.pointerId)) {
      const by = pointers.get(event.pointerId) - timeAt(event);
      look(from + by, to + by);
    } else if (pointers.size === 2 && pointers.has(event.pointerId)) {
      // the times under both fingers stay there
      const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, t]) => t);
      const held = pointers.get(event.pointerId), now = timeAt(event);
      if (Math.abs(now - other) > 0.02 * (to - from)) zoom(Math.min(Math.max(Math.abs((held - other) / (now - other)), 0.5), 2), other);
    } else return;
    draw();
  });
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, event => pointers.delete(event.pointerId));

  choice.addEventListener("change", () => {
    record = given.records[Number(choice.value)];
    data = opened(record);
    first();
    home();
    draw();
  });
  bent.addEventListener("change", draw);
  first();
  home();
  new ResizeObserver(draw).observe(area);
  draw();
}

document.querySelectorAll("[data-viewer]").forEach(start);
})();
