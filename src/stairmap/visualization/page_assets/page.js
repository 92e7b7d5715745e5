// Puts the page together: scene, labels, layers to switch, rows that lead to their stairway.
(function start() {
  const scene = JSON.parse(document.getElementById("data").textContent);
  const canvas = document.getElementById("scene");
  let renderer;
  try {
    renderer = new Renderer(canvas, scene);
  } catch (error) {
    const text = document.createElement("p");
    text.className = "failure";
    text.textContent = `The 3-D view cannot be shown: ${error.message}. The measures below hold without it.`;
    document.body.append(text);
    document.getElementById("layers").remove();
    return;
  }
  const labels = scene.labels.map((label) => {
    const element = document.createElement("div");
    element.className = "label";
    element.style.borderColor = `rgb(${label.color.join(",")})`;
    label.lines.forEach((line, index) => {
      const part = document.createElement(index ? "span" : "b");
      part.textContent = line;
      element.append(part, ...(index ? [document.createElement("br")] : []));
    });
    document.getElementById("labels").append(element);
    return { ...label, element };
  });
  let labelsVisible = true;
  let waiting = false;

  function draw() {
    waiting = false;
    renderer.draw(orbit.eye(), orbit.target);
    for (const label of labels) {
      const place = labelsVisible ? renderer.project(label.place) : null;
      label.element.style.display = place ? "block" : "none";
      if (place) [label.element.style.left, label.element.style.top] = place.map((value) => `${value}px`);
    }
  }

  function changed() {
    if (!waiting) requestAnimationFrame(draw);
    waiting = true;
  }

  function addSwitch(name, isOn, set) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = isOn;
    box.addEventListener("change", () => { set(box.checked); changed(); });
    label.append(box, name);
    document.getElementById("layers").append(label);
  }

  const orbit = new Orbit(canvas, changed);

  // Views are placed for a wide window; in a narrow one, as on a phone, the eye steps back.
  function lookFrom(eye, target) {
    const back = Math.max(1, (1.3 * canvas.clientHeight) / canvas.clientWidth);
    orbit.lookFrom(eye.map((value, axis) => target[axis] + back * (value - target[axis])), target);
  }

  addSwitch("cloud", true, (isOn) => { renderer.cloud.visible = isOn; });
  for (const layer of renderer.layers.filter((item) => item.meshes.some((mesh) => mesh.count))) {
    addSwitch(layer.name, layer.visible, (isOn) => { layer.visible = isOn; });
  }
  if (labels.length) addSwitch("labels", true, (isOn) => { labelsVisible = isOn; });
  for (const row of document.querySelectorAll("tr[data-stairway]")) {
    const label = labels.find((item) => String(item.stairway) === row.dataset.stairway);
    if (label) row.addEventListener("click", () => lookFrom(label.eye, label.target));
  }
  window.addEventListener("resize", changed);
  window.addEventListener("keydown", (event) => {
    if (event.key === "r" || event.key === "R") lookFrom(scene.eye, [0, 0, 0]);
  });
  lookFrom(scene.eye, [0, 0, 0]);
})();
