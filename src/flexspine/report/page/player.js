// Plays the postures of a run on a canvas: the camera follows the centre of mass.
"use strict";

const LABELLED = 5; // strokes of the ground from one that has its place beside it to the next
const TALLEST = 420; // px

class Player {
  constructor(root, film) {
    this.root = root;
    this.film = film;
    this.canvas = root.querySelector("canvas");
    this.slider = root.querySelector("input");
    this.clock = root.querySelector("output");
    this.words = root.querySelector(".words");
    this.button = root.querySelector("button");
    this.speed = root.querySelector("select");
    this.slider.max = film.frames.length - 1;
    this.playing = false;
    this.listeners = [];
    this.button.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => this.show(Number(this.slider.value)));
    root.addEventListener("keydown", (event) => this.press(event));
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
    this.show(0);
  }

  press(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (step && event.target !== this.slider && event.target !== this.speed) {
      this.show(this.frame + step);
      event.preventDefault();
    } else if (event.key === " " && event.target === this.canvas) {
      this.toggle();
      event.preventDefault();
    }
  }

  toggle() {
    this.playing = !this.playing;
    this.button.textContent = this.playing ? "Pause" : "Play";
    if (!this.playing) return;
    if (this.frame === this.film.frames.length - 1) this.show(0);
    let before = performance.now();
    let time = this.film.frames[this.frame][0];
    const next = (now) => {
      if (!this.playing) return;
      time += (Number(this.speed.value) * (now - before)) / 1000;
      before = now;
      this.seek(time);
      if (this.frame === this.film.frames.length - 1) this.toggle();
      else requestAnimationFrame(next);
    };
    requestAnimationFrame(next);
  }

  // Shows the frame that is nearest to a time in s; frames are evenly apart.
  seek(time) {
    const frames = this.film.frames;
    const first = frames[0][0];
    const last = frames[frames.length - 1][0];
    this.show(Math.round(((time - first) / (last - first)) * (frames.length - 1)));
  }

  show(number) {
    this.frame = Math.max(0, Math.min(this.film.frames.length - 1, number));
    const [time, , , , words] = this.film.frames[this.frame];
    this.slider.value = this.frame;
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(3)} s`);
    this.clock.textContent = `t = ${time.toFixed(3)} s`;
    this.words.textContent = this.film.words[words];
    this.draw();
    for (const listener of this.listeners) listener(time);
  }

  resize() {
    const view = this.film.view;
    const width = this.canvas.parentElement.clientWidth;
    const height = Math.min((width * (view.high - view.low)) / (2 * view.aside), TALLEST);
    const dots = window.devicePixelRatio || 1;
    this.canvas.style.height = `${height}px`;
    this.canvas.width = Math.round(width * dots);
    this.canvas.height = Math.round(height * dots);
    this.draw();
  }

  draw() {
    const { view, leg, parts, frames } = this.film;
    const frame = frames[this.frame];
    const [, level, x, y] = frame;
    const pen = this.canvas.getContext("2d");
    const { width, height } = this.canvas;
    const metre = height / (view.high - view.low);
    const at = (px, py) => [width / 2 + (px - x) * metre, height - (py - level - view.low) * metre];
    const style = getComputedStyle(this.root);
    const ink = style.getPropertyValue("--ink");
    const paper = style.getPropertyValue("--paper");
    const color = (name) => (name === "ink" ? ink : name);
    pen.clearRect(0, 0, width, height);
    pen.lineCap = pen.lineJoin = "round";
    this.ground(pen, at, x, width / metre / 2, metre, ink, style.getPropertyValue("--faint"));
    const feet = [];
    let place = 5;
    for (const [kind, name, size, count] of parts) {
      const ends = [];
      for (let i = 0; i < count; i++, place += 2) ends.push(at(frame[place], frame[place + 1]));
      if (kind === "stroke") this.stroke(pen, ends, color(name), size * leg * metre);
      else if (kind === "dot") this.dot(pen, ends[0], (size * leg * metre) / 2, color(name), paper);
      else {
        const [state, along, up] = frame.slice(place, (place += 3));
        const fill = state === 2 ? ink : state === 1 ? color(name) : paper;
        this.dot(pen, ends[0], (size * leg * metre) / 2, color(name), fill);
        feet.push([ends[0], along, up, color(name)]);
      }
    }
    for (const foot of feet) this.arrow(pen, metre, ...foot);
    this.dot(pen, at(x, y), 0.035 * leg * metre, ink, paper);
    this.dot(pen, at(x, y), 0.012 * leg * metre, ink, ink);
  }

  stroke(pen, ends, color, width) {
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.beginPath();
    ends.forEach((end) => pen.lineTo(...end));
    pen.stroke();
  }

  dot(pen, [px, py], radius, edge, fill) {
    pen.beginPath();
    pen.arc(px, py, radius, 0, 2 * Math.PI);
    pen.fillStyle = fill;
    pen.fill();
    pen.strokeStyle = edge;
    pen.lineWidth = radius / 2.2;
    pen.stroke();
  }

  // The force on a foot, its head at the foot.
  arrow(pen, metre, [px, py], along, up, color) {
    const scale = this.film.arrow * metre;
    const [fx, fy] = [along * scale, -up * scale];
    const length = Math.hypot(fx, fy);
    if (length < 0.02 * this.film.leg * metre) return;
    const [ux, uy] = [fx / length, fy / length];
    const wide = (this.film.arrow_width * this.film.leg * metre) / 2;
    const head = Math.min(5 * wide, length);
    const [nx, ny] = [px - ux * head, py - uy * head];
    pen.globalAlpha = 0.75;
    this.stroke(pen, [[px - fx, py - fy], [nx, ny]], color, wide);
    pen.beginPath();
    pen.moveTo(px, py);
    pen.lineTo(nx - uy * 2 * wide, ny + ux * 2 * wide);
    pen.lineTo(nx + uy * 2 * wide, ny - ux * 2 * wide);
    pen.fillStyle = color;
    pen.fill();
    pen.globalAlpha = 1;
  }

  // A line with strokes below it that show how the way passes.
  ground(pen, at, x, aside, metre, ink, faint) {
    const way = this.film.ground || [x - aside, 0, x + aside, 0];
    const ends = [];
    for (let i = 0; i < way.length; i += 2) ends.push(at(way[i], way[i + 1]));
    const step = this.film.stroke;
    for (let k = Math.floor((x - aside) / step); k * step < x + aside + step; k++) {
      const [px, py] = at(k * step, this.height(k * step));
      const depth = 0.35 * step * metre;
      this.stroke(pen, [[px, py], [px - depth, py + depth]], faint, 1);
      if (k % LABELLED === 0) {
        pen.fillStyle = faint;
        pen.font = `${Math.max(11, 0.05 * this.film.leg * metre)}px system-ui, sans-serif`;
        pen.fillText(`${Number((k * step).toPrecision(6))} m`, px, py + 2.6 * depth);
      }
    }
    this.stroke(pen, ends, ink, 1.5);
  }

  height(x) {
    const way = this.film.ground;
    if (!way) return 0;
    let i = 2;
    while (i < way.length - 2 && way[i] < x) i += 2;
    const [x1, y1, x2, y2] = way.slice(i - 2, i + 2);
    return x2 > x1 ? y1 + ((y2 - y1) * (Math.min(Math.max(x, x1), x2) - x1)) / (x2 - x1) : y1;
  }
}
