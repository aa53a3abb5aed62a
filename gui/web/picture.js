// <lab-picture>: one or two pictures under one zoom, with a divider between them. Panning, zooming, hovering and the
// keys are answered here, at once; the page hears of them when they are done.
(function () {
  const { h, defineComponent } = window.Vue;
  const CLICK_PX = 4; // a press that moves less is a click
  const HOVER_MS = 90; // at most this often the page is asked for the numbers under the pointer
  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

  const LabPicture = defineComponent({
    name: "LabPicture",
    props: {
      a: { type: String, default: "" },
      b: { type: String, default: "" },
      titleA: { type: String, default: "" },
      titleB: { type: String, default: "" },
      wipe: { type: Number, default: 0.5 },
      zoom: { type: Number, default: 1 },
      centre: { type: Array, default: () => [0.5, 0.5] },
      size: { type: Array, default: () => [16, 9] },
      pixel: { type: Array, default: null },
      marks: { type: Array, default: () => [] },
    },
    emits: ["view", "wipeTo", "pixelAt", "hover", "action"],
    data() {
      return { room: [1, 1], at: { zoom: this.zoom, x: this.centre[0], y: this.centre[1] }, divider: this.wipe, press: null, hovered: 0 };
    },
    watch: {
      zoom(value) { this.at.zoom = value; },
      centre(value) { this.at.x = value[0]; this.at.y = value[1]; },
      wipe(value) { this.divider = value; },
    },
    computed: {
      scale() { return Math.min(this.room[0] / this.size[0], this.room[1] / this.size[1]) * this.at.zoom; },
      left() { return this.room[0] / 2 - this.at.x * this.size[0] * this.scale; },
      top() { return this.room[1] / 2 - this.at.y * this.size[1] * this.scale; },
    },
    mounted() {
      this.watcher = new ResizeObserver(() => this.measure());
      this.watcher.observe(this.$el);
      this.measure();
      window.addEventListener("keydown", this.key);
    },
    beforeUnmount() {
      this.watcher.disconnect();
      window.removeEventListener("keydown", this.key);
    },
    methods: {
      measure() { this.room = [Math.max(this.$el.clientWidth, 1), Math.max(this.$el.clientHeight, 1)]; },
      where(event) {
        const box = this.$el.getBoundingClientRect();
        return [(event.clientX - box.left - this.left) / this.scale, (event.clientY - box.top - this.top) / this.scale];
      },
      inside([x, y]) { return x >= 0 && y >= 0 && x < this.size[0] && y < this.size[1]; },
      report() { this.$emit("view", { zoom: this.at.zoom, centre: [this.at.x, this.at.y] }); },
      fit() { this.at = { zoom: 1, x: 0.5, y: 0.5 }; this.report(); },
      magnify(factor, x, y) {
        const before = this.scale;
        this.at.zoom = clamp(this.at.zoom * factor, 0.5, 256);
        const kept = before / this.scale; // the point under the pointer stays there
        this.at.x = clamp(x / this.size[0] + (this.at.x - x / this.size[0]) * kept, -1, 2);
        this.at.y = clamp(y / this.size[1] + (this.at.y - y / this.size[1]) * kept, -1, 2);
        clearTimeout(this.settled);
        this.settled = setTimeout(() => this.report(), 200);
      },
      enter() {
        // Over the picture keys mean the picture, not the menu that was chosen from before.
        const active = document.activeElement;
        if (active && active.closest(".lab-choices")) active.blur();
      },
      wheel(event) {
        event.preventDefault();
        const [x, y] = this.where(event);
        this.magnify(Math.exp(-event.deltaY / 400), x, y);
      },
      down(event) {
        if (event.button !== 0) return;
        const wiping = event.target.classList.contains("lab-divider");
        this.press = { x: event.clientX, y: event.clientY, wiping, moved: false, at: { ...this.at } };
        this.$el.setPointerCapture(event.pointerId);
      },
      move(event) {
        const [x, y] = this.where(event);
        const press = this.press;
        if (!press) {
          const now = Date.now();
          if (this.inside([x, y]) && now - this.hovered > HOVER_MS) {
            this.hovered = now;
            this.$emit("hover", [Math.floor(x), Math.floor(y)]);
          }
          return;
        }
        if (press.wiping) {
          this.divider = clamp(x / this.size[0], 0, 1);
          press.moved = true;
        } else {
          const dx = event.clientX - press.x, dy = event.clientY - press.y;
          if (Math.hypot(dx, dy) > CLICK_PX) press.moved = true;
          if (press.moved) {
            this.at.x = clamp(press.at.x - dx / (this.size[0] * this.scale), -1, 2);
            this.at.y = clamp(press.at.y - dy / (this.size[1] * this.scale), -1, 2);
          }
        }
      },
      up(event) {
        const press = this.press;
        this.press = null;
        if (!press) return;
        if (press.wiping) this.$emit("wipeTo", this.divider);
        else if (press.moved) this.report();
        else {
          const at = this.where(event);
          if (this.inside(at)) this.$emit("pixelAt", at.map(Math.floor));
        }
      },
      key(event) {
        // Fields and menus have keys of their own; sliders and tabs have taken theirs before.
        const own = "input:not([type=checkbox]), textarea, [contenteditable], [role=listbox]";
        const taken = event.defaultPrevented || (event.target.closest && event.target.closest(own));
        if (taken || event.ctrlKey || event.metaKey || event.altKey) return;
        const digit = /^Digit([1-9])$/.exec(event.code);
        if (digit) this.$emit("action", { name: event.shiftKey ? "other" : "layer", number: Number(digit[1]) });
        else if (event.code === "KeyF") this.fit();
        else if (event.code === "KeyE") this.$emit("action", { name: "exposure", number: event.shiftKey ? -0.5 : 0.5 });
        else if (event.code === "KeyR") this.$emit("action", { name: "exposure", number: 0 });
        else if (event.code === "KeyW") this.$emit("action", { name: "wipe", number: 0 });
        else if (event.code === "KeyD") this.$emit("action", { name: "difference", number: 0 });
        else if (event.code === "ArrowRight") this.$emit("action", { name: "next", number: 1 });
        else if (event.code === "ArrowLeft") this.$emit("action", { name: "next", number: -1 });
        else if (event.key === "?") this.$emit("action", { name: "help", number: 0 });
        else return;
        event.preventDefault();
      },
      image(source, kind, clip) {
        const style = {
          left: `${this.left}px`, top: `${this.top}px`,
          width: `${this.size[0] * this.scale}px`, height: `${this.size[1] * this.scale}px`,
          imageRendering: this.scale > 1.5 ? "pixelated" : "auto", clipPath: clip,
        };
        return source ? h("img", { src: source, class: `lab-image lab-image-${kind}`, style, draggable: false }) : null;
      },
      mark(x, y, kind) {
        const side = Math.max(this.scale, 9);
        const style = {
          left: `${this.left + (x + 0.5) * this.scale - side / 2}px`,
          top: `${this.top + (y + 0.5) * this.scale - side / 2}px`, width: `${side}px`, height: `${side}px`,
        };
        return h("div", { class: `lab-mark lab-mark-${kind}`, style });
      },
    },
    render() {
      const both = Boolean(this.b);
      const x = this.left + this.divider * this.size[0] * this.scale;
      const cut = `${100 * this.divider}%`;
      return h(
        "div",
        { class: "lab-picture", onWheel: this.wheel, onPointerdown: this.down, onPointermove: this.move, onPointerup: this.up, onPointerenter: this.enter, onDblclick: this.fit },
        [
          this.image(this.a, "a", both ? `inset(0 calc(100% - ${cut}) 0 0)` : "none"),
          both ? this.image(this.b, "b", `inset(0 0 0 ${cut})`) : null,
          ...this.marks.map(([mx, my]) => this.mark(mx, my, "spot")),
          this.pixel ? this.mark(this.pixel[0], this.pixel[1], "pixel") : null,
          both ? h("div", { class: "lab-divider", style: { left: `${x}px` } }) : null,
          this.titleA ? h("span", { class: "lab-title lab-title-a" }, this.titleA) : null,
          both && this.titleB ? h("span", { class: "lab-title lab-title-b" }, this.titleB) : null,
        ],
      );
    },
  });

  window.labInspector = { install(app) { app.component("lab-picture", LabPicture); } };
})();
