// A map in a browser: what io/export/page.cpp put into the element "data". Nothing is loaded.
(function () {
  'use strict';
  const errors = [];
  window.addEventListener('error', (event) => errors.push(String(event.message)));
  const consoleError = console.error;
  console.error = (...parts) => { errors.push(parts.map(String).join(' ')); consoleError(...parts); };

  const byId = (id) => document.getElementById(id);
  const data = JSON.parse(byId('data').textContent);
  const bytesOf = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const textOf = (base64) => new TextDecoder().decode(bytesOf(base64));
  const metres = (value) => value.toFixed(Math.abs(value) < 1 ? 3 : 2) + ' m';
  const listed = (values) => values.map((v) => v.toFixed(3)).join(', ');

  // -- What the map holds. A record has the layout of appendCuboid() in page.cpp.
  function readCuboids(base64) {
    const bytes = bytesOf(base64);
    const view = new DataView(bytes.buffer);
    const kRecord = 52;
    const count = bytes.length / kRecord;
    const all = { count, center: new Float32Array(3 * count), turn: new Float32Array(4 * count), size: new Float32Array(3 * count),
      probability: new Float32Array(count), plane: new Int32Array(count), colour: new Float32Array(3 * count) };
    const floats = (into, i, width, at) => { for (let k = 0; k < width; ++k) into[width * i + k] = view.getFloat32(at + 4 * k, true); };
    for (let i = 0; i < count; ++i) {
      const at = kRecord * i;
      floats(all.center, i, 3, at);
      floats(all.turn, i, 4, at + 12);
      floats(all.size, i, 3, at + 28);
      floats(all.probability, i, 1, at + 40);
      all.plane[i] = view.getInt32(at + 44, true);
      for (let k = 0; k < 3; ++k) all.colour[3 * i + k] = bytes[at + 48 + k] / 255;
    }
    return all;
  }
  const occupied = readCuboids(data.occupied);
  const unknown = readCuboids(data.unknown);
  const path = new Float32Array(bytesOf(data.path).buffer);
  const planes = new Map(data.planes.map((plane) => [plane.id, plane]));
  const title = textOf(data.title);
  document.title = title;
  byId('title').textContent = title;

  // -- Tables
  function addRow(table, name, value) {
    const row = table.insertRow();
    row.insertCell().textContent = name;
    row.insertCell().textContent = value;
  }
  function readTable(text) {  // CSV; fields with commas are quoted
    return text.trim().split('\n').map((line) =>
      (line.match(/("([^"]|"")*"|[^,]*)(,|$)/g) || []).map((f) => f.replace(/,$/, '').replace(/^"|"$/g, '').replace(/""/g, '"')));
  }
  const run = data.run && { metrics: textOf(data.run.metrics), frames: textOf(data.run.frames), log: textOf(data.run.log) };
  const bytesText = (n) => n < 1e4 ? n + ' B' : n < 1e7 ? (n / 1e3).toFixed(0) + ' kB' : (n / 1e6).toFixed(1) + ' MB';
  function showFigures() {
    const table = byId('figures');
    const add = (name, value) => { if (value !== undefined && value !== null) addRow(table, name, value); };
    add('cuboids', occupied.count);
    add('planes', data.planes.length);
    add('frames', data.frames);
    add('side of a cell', metres(data.resolution));
    if (data.origin.some((v) => v !== 0)) add('origin', listed(data.origin));
    if (!run || !run.metrics) return;
    let m;
    try { m = JSON.parse(run.metrics); } catch (error) { add('metrics.json', 'cannot be read'); return; }
    const percent = (v) => typeof v === 'number' ? (100 * v).toFixed(1) + ' %' : undefined;
    if (m.frames_skipped) add('frames left out', m.frames_skipped);
    if (m.points) { add('points', m.points.valid); add('points on planes', m.points.planar); }
    add('points covered', percent(m.coverage));
    add('cells of a grid instead', m.standard_cells);
    if (m.memory_bytes) add('memory', bytesText(m.memory_bytes));
    if (m.file_bytes) add('file', bytesText(m.file_bytes));
    const t = m.time_ms && m.time_ms.frame;
    if (t) { add('a frame, median', t.median.toFixed(1) + ' ms'); add('a frame, 95 %', t.p95.toFixed(1) + ' ms'); }
    add('threads', m.threads);
    add('version', m.version);
    if (m.interrupted) add('interrupted', 'yes');
  }
  const kStageColours = ['#4878a8', '#e08a3c', '#6aa84f', '#b45f9a', '#8c6d46', '#d0b53a', '#5fb3b3', '#9a9a9a', '#c0504d', '#7f6fb0'];
  function showTimes() {
    if (!run || !run.frames) return;
    const [head, ...rows] = readTable(run.frames);
    const whole = head.indexOf('frame_ms');
    const stages = head.map((name, i) => ({ name, i })).filter((c) => c.name.endsWith('_ms') && c.i !== whole && rows.some((r) => +r[c.i] > 0));
    if (whole < 0 || rows.length === 0) return;
    byId('times-part').hidden = false;
    const canvas = byId('times'), g = canvas.getContext('2d'), left = 80, bottom = 28, top = 10;
    const most = Math.max(...rows.map((r) => Math.max(+r[whole] || 0, stages.reduce((sum, c) => sum + (+r[c.i] || 0), 0))), 1e-3);
    const width = (canvas.width - left - 4) / rows.length, scale = (canvas.height - bottom - top) / most;
    rows.forEach((row, n) => {
      let y = canvas.height - bottom;
      const bar = (value, colour) => { g.fillStyle = colour; g.fillRect(left + n * width, y - value * scale, Math.max(width * 0.9, 0.5), value * scale); y -= value * scale; };
      stages.forEach((c, k) => bar(+row[c.i] || 0, kStageColours[k % kStageColours.length]));
      bar(Math.max(0, (+row[whole] || 0) - stages.reduce((sum, c) => sum + (+row[c.i] || 0), 0)), '#d5dae0');
    });
    g.fillStyle = '#1d2733';
    g.font = '22px sans-serif';
    g.textAlign = 'right';
    g.fillText(most.toFixed(0) + ' ms', left - 4, top + 16);
    g.fillText('0', left - 4, canvas.height - bottom);
    g.textAlign = 'left';
    g.fillText('frame ' + rows[0][0], left, canvas.height - 4);
    g.textAlign = 'right';
    g.fillText(rows[rows.length - 1][0], canvas.width - 4, canvas.height - 4);
    const median = (i) => rows.map((r) => +r[i] || 0).sort((a, b) => a - b)[rows.length >> 1].toFixed(1) + ' ms';
    [...stages.map((c, k) => [c.name.replace(/_ms$/, '').replace(/_/g, ' ') + ' ' + median(c.i), kStageColours[k % kStageColours.length]]), ['rest', '#d5dae0']].forEach(([name, colour]) => {
      const entry = document.createElement('span'), patch = document.createElement('i');
      patch.style.background = colour;
      entry.append(patch, name);
      byId('times-legend').append(entry);
    });
  }
  function showWarnings() {
    const lines = run ? run.log.split('\n').filter((line) => line.startsWith('warning: ')) : [];
    byId('warnings-part').hidden = lines.length === 0;
    for (const line of lines) {
      const item = document.createElement('li');
      item.textContent = line.slice('warning: '.length);
      byId('warnings').append(item);
    }
  }
  showFigures();
  showTimes();
  showWarnings();

  // -- The 3-D view. World: the axes of the map turned so that up is z.
  const view = byId('view');
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas: view, antialias: true, preserveDrawingBuffer: true });
  } catch (error) {
    byId('failure').hidden = false;
    byId('failure').textContent = 'This browser draws no WebGL: the map in 3-D is missing, the plan and the figures are there.';
  }
  const turnToUp = new THREE.Quaternion().fromArray(data.turn);
  const kBackground = 0xe9edf2;
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(kBackground);
  const world = new THREE.Group();
  world.quaternion.copy(turnToUp);
  scene.add(world);
  const camera = new THREE.PerspectiveCamera(45, 1, 0.05, 1000);
  camera.up.set(0, 0, 1);
  const controls = new THREE.OrbitControls(camera, view);

  const kVertex = `
    attribute vec3 local; attribute vec3 face; attribute vec3 colour; attribute vec4 back;
    uniform float hideBacks;
    varying vec3 vColour; varying vec3 vNormal; varying vec3 vLocal; varying vec3 vHalf; varying vec3 vFace;
    void main() {
      vLocal = local; vHalf = abs(local); vColour = colour; vNormal = mat3(modelMatrix) * normal;
      vFace = face;
      vec3 eye = cameraPosition * mat3(modelMatrix);  // in the map, which is turned only
      bool hidden = hideBacks > 0.5 && dot(back.xyz, eye) < back.w;
      gl_Position = hidden ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    }`;
  const kFragment = `
    uniform float opacity;
    varying vec3 vColour; varying vec3 vNormal; varying vec3 vLocal; varying vec3 vHalf; varying vec3 vFace;
    void main() {
      vec3 toEdge = vHalf - abs(vLocal) + vFace * 1e6;
      float edge = min(toEdge.x, min(toEdge.y, toEdge.z));
      float line = 1.0 - smoothstep(0.0, 1.5, edge / max(fwidth(edge), 1e-6));
      vec3 n = normalize(vNormal);
      float light = 0.62 + 0.28 * max(dot(n, normalize(vec3(0.35, 0.2, 0.9))), 0.0) + 0.16 * abs(n.x);
      gl_FragColor = vec4(vColour * light * (1.0 - 0.35 * line), opacity);
    }`;
  /// All boxes as one mesh, drawn by one call. back: the plane of a cuboid, from whose far side it is not seen.
  function boxesOf(all, opacity) {
    const box = new THREE.BoxBufferGeometry(1, 1, 1), corners = box.attributes.position, sides = box.attributes.normal;
    const n = corners.count, m = box.index.count;
    const position = new Float32Array(3 * n * all.count), local = position.slice(), normal = new Int8Array(3 * n * all.count);
    const face = new Uint8Array(3 * n * all.count), back = new Float32Array(4 * n * all.count), index = new Uint32Array(m * all.count);
    const q = new THREE.Quaternion(), center = new THREE.Vector3(), size = new THREE.Vector3(), v = new THREE.Vector3(), up = new THREE.Vector3();
    for (let i = 0; i < all.count; ++i) {
      q.fromArray(all.turn, 4 * i);
      center.fromArray(all.center, 3 * i);
      size.fromArray(all.size, 3 * i);
      const onPlane = all.plane[i] >= 0;
      up.set(0, 0, onPlane ? 1 : 0).applyQuaternion(q);
      for (let k = 0; k < n; ++k) {
        const at = 3 * (n * i + k);
        v.fromBufferAttribute(corners, k).multiply(size).toArray(local, at);
        v.applyQuaternion(q).add(center).toArray(position, at);
        for (let axis = 0; axis < 3; ++axis) face[at + axis] = Math.abs(sides.array[3 * k + axis]);
        v.fromBufferAttribute(sides, k).applyQuaternion(q).multiplyScalar(127).toArray(normal, at);
        back.set([up.x, up.y, up.z, onPlane ? up.dot(center) : -1], 4 * (n * i + k));
      }
      for (let k = 0; k < m; ++k) index[m * i + k] = n * i + box.index.array[k];
    }
    const geometry = new THREE.BufferGeometry();
    const add = (name, array, width, normalized) => geometry.setAttribute(name, new THREE.BufferAttribute(array, width, normalized));
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    add('position', position, 3);
    add('local', local, 3);
    add('normal', normal, 3, true);
    add('face', face, 3);
    add('colour', new Uint8Array(3 * n * all.count), 3, true);
    add('back', back, 4);
    const material = new THREE.ShaderMaterial({ vertexShader: kVertex, fragmentShader: kFragment, extensions: { derivatives: true },
      uniforms: { opacity: { value: opacity }, hideBacks: { value: 1 } }, transparent: opacity < 1, depthWrite: opacity === 1 });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    world.add(mesh);
    return mesh;
  }
  const occupiedMesh = boxesOf(occupied, 1);
  const unknownMesh = boxesOf(unknown, 0.18);
  unknownMesh.visible = false;
  const lineOf = (points, colour, onTop) => {
    const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(points, 3));
    const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: colour, depthTest: !onTop }));
    line.frustumCulled = false;
    world.add(line);
    return line;
  };
  const pathLine = lineOf(path, 0xc02020, true);
  const chosenBox = new THREE.LineSegments(new THREE.EdgesGeometry(new THREE.BoxBufferGeometry(1, 1, 1)),
    new THREE.LineBasicMaterial({ color: 0xff2200, depthTest: false }));
  chosenBox.visible = false;
  world.add(chosenBox);
  let measureLine = null;

  const inWorld = (all, i) => new THREE.Vector3().fromArray(all.center, 3 * i).applyQuaternion(turnToUp);
  /// A value between two quantiles of the centres, by surface: one far cuboid does not count.
  function robustBounds() {
    const low = new THREE.Vector3(-1, -1, -1), high = new THREE.Vector3(1, 1, 1);
    if (occupied.count === 0) return new THREE.Box3(low, high);
    const kOutside = 0.01;
    const places = [], weights = [];
    for (let i = 0; i < occupied.count; ++i) {
      const s = occupied.size.subarray(3 * i, 3 * i + 3);
      places.push(inWorld(occupied, i));
      weights.push(s[0] * s[1] + s[1] * s[2] + s[2] * s[0]);
    }
    const sum = weights.reduce((a, b) => a + b, 0);
    for (const axis of ['x', 'y', 'z']) {
      const order = places.map((_, i) => i).sort((a, b) => places[a][axis] - places[b][axis]);
      let passed = 0, first = null, last = null;
      for (const i of order) {
        passed += weights[i];
        if (first === null && passed >= kOutside * sum) first = i;
        if (last === null && passed >= (1 - kOutside) * sum) last = i;
      }
      low[axis] = places[first][axis];
      high[axis] = places[last][axis];
    }
    return new THREE.Box3(low, high);
  }
  const frame = robustBounds();
  const middle = frame.getCenter(new THREE.Vector3());
  const radius = Math.max(0.5 * frame.getSize(new THREE.Vector3()).length(), 4 * data.resolution);
  function showAll() {
    controls.target.copy(middle);
    camera.position.copy(middle).addScaledVector(new THREE.Vector3(-0.75, -1, 0.85).normalize(), 0.95 * radius / Math.sin(camera.fov * Math.PI / 360) / Math.min(1, camera.aspect));
    camera.near = radius / 500;
    camera.far = radius * 100;
    camera.updateProjectionMatrix();
    controls.update();
  }

  /// \param colourOf  sets a colour for cuboid i
  function paint(mesh, all, colourOf) {
    const colours = mesh.geometry.attributes.colour, n = colours.count / Math.max(all.count, 1), c = new THREE.Color();
    for (let i = 0; i < all.count; ++i) {
      colourOf(c, i);
      for (let k = 0; k < n; ++k) colours.array.set([255 * c.r, 255 * c.g, 255 * c.b], 3 * (n * i + k));
    }
    colours.needsUpdate = true;
  }
  const own = (all) => (c, i) => c.fromArray(all.colour, 3 * i);
  function colourBy(kind) {
    const span = Math.max(frame.max.z - frame.min.z, 1e-6);
    const part = (i) => kind === 'height' ? (inWorld(occupied, i).z - frame.min.z) / span : occupied.probability[i];
    paint(occupiedMesh, occupied, kind === 'plane' ? own(occupied) :
      (c, i) => c.setHSL(0.66 * (1 - Math.min(1, Math.max(0, part(i)))), 0.75, 0.55));  // blue: low, red: high
  }
  colourBy('plane');
  paint(unknownMesh, unknown, own(unknown));

  let asked = false;
  function draw() {
    if (asked || !renderer) return;
    asked = true;
    requestAnimationFrame(drawNow);
  }
  function drawNow() {
    asked = false;
    if (renderer) renderer.render(scene, camera);
  }
  function fit() {
    const width = view.parentElement.clientWidth, height = view.parentElement.clientHeight;
    if (renderer) {
      renderer.setPixelRatio(window.devicePixelRatio);
      renderer.setSize(width, height, false);
    }
    camera.aspect = width / Math.max(height, 1);
    camera.updateProjectionMatrix();
    draw();
  }

  // -- Picking: the ray against each box.
  function nearestHit(all, origin, direction, hidesBacks) {
    let best = null;
    const q = new THREE.Quaternion(), o = new THREE.Vector3(), d = new THREE.Vector3(), eye = new THREE.Vector3();
    for (let i = 0; i < all.count; ++i) {
      q.fromArray(all.turn, 4 * i).conjugate();
      eye.copy(origin).sub(o.fromArray(all.center, 3 * i)).applyQuaternion(q);
      if (hidesBacks && all.plane[i] >= 0 && eye.z < 0) continue;
      d.copy(direction).applyQuaternion(q);
      let enter = 0, leave = Infinity;
      for (let k = 0; k < 3; ++k) {
        const at = eye.getComponent(k), along = d.getComponent(k), half = 0.5 * all.size[3 * i + k];
        if (Math.abs(along) < 1e-12) { if (Math.abs(at) > half) leave = -1; continue; }
        const a = (-half - at) / along, b = (half - at) / along;
        enter = Math.max(enter, Math.min(a, b));
        leave = Math.min(leave, Math.max(a, b));
      }
      if (enter <= leave && (best === null || enter < best.distance)) best = { index: i, distance: enter };
    }
    return best;
  }
  function hitAt(clientX, clientY) {
    const box = view.getBoundingClientRect();
    const caster = new THREE.Raycaster();
    camera.updateMatrixWorld();
    caster.setFromCamera({ x: 2 * (clientX - box.left) / box.width - 1, y: 1 - 2 * (clientY - box.top) / box.height }, camera);
    const back = turnToUp.clone().conjugate();
    const origin = caster.ray.origin.clone().applyQuaternion(back), direction = caster.ray.direction.clone().applyQuaternion(back);
    const find = (all, mesh, state) => {
      const hit = mesh.visible ? nearestHit(all, origin, direction, state === 'occupied' && byId('see-through').checked) : null;
      return hit && { all, state, index: hit.index, point: origin.clone().addScaledVector(direction, hit.distance) };
    };
    return find(occupied, occupiedMesh, 'occupied') || find(unknown, unknownMesh, 'unknown');
  }
  const coordinates = (array, i) => [0, 1, 2].map((k) => array[3 * i + k] + data.origin[k]);
  function showChosen(hit) {
    const place = byId('chosen');
    place.textContent = '';
    place.className = '';
    chosenBox.visible = hit !== null;
    if (!hit) {
      place.textContent = 'Nothing there.';
      return;
    }
    const { all, index } = hit;
    chosenBox.position.fromArray(all.center, 3 * index);
    chosenBox.quaternion.fromArray(all.turn, 4 * index);
    chosenBox.scale.fromArray(all.size, 3 * index);
    const table = document.createElement('table');
    addRow(table, 'state', hit.state);
    if (hit.state === 'occupied') addRow(table, 'cuboid', index);
    addRow(table, 'centre, m', listed(coordinates(all.center, index)));
    addRow(table, 'size, m', listed([...all.size.subarray(3 * index, 3 * index + 3)]));
    addRow(table, 'quaternion x y z w', listed([...all.turn.subarray(4 * index, 4 * index + 4)]));
    addRow(table, 'probability', all.probability[index].toFixed(3));
    addRow(table, 'plane', all.plane[index] < 0 ? 'none' : all.plane[index]);
    const plane = planes.get(all.plane[index]);
    if (plane) {
      addRow(table, 'its normal', listed(plane.normal));
      addRow(table, 'its rms', (1e3 * plane.rms).toFixed(1) + ' mm');
      addRow(table, 'seen in frames', plane.frames);
    }
    place.append(table);
  }
  let start = null;
  function measureTo(hit) {
    if (!hit) return;
    if (start === null) {
      start = hit.point;
      byId('chosen').textContent = 'From ' + listed(start.toArray().map((v, k) => v + data.origin[k])) + '; click the other end.';
      return;
    }
    const difference = hit.point.clone().sub(start);
    if (measureLine) world.remove(measureLine);
    measureLine = lineOf(Float32Array.from([...start.toArray(), ...hit.point.toArray()]), 0x0030c0, true);
    const table = document.createElement('table');
    addRow(table, 'distance', metres(difference.length()));
    addRow(table, 'along x, y, z, m', listed(difference.toArray()));
    addRow(table, 'height difference', metres(difference.clone().applyQuaternion(turnToUp).z));
    byId('chosen').textContent = '';
    byId('chosen').append(table);
    start = null;
  }
  let pressed = null;
  view.addEventListener('pointerdown', (event) => { pressed = [event.clientX, event.clientY]; });
  view.addEventListener('click', (event) => {
    const kStill = 4;  // pixels; more is a drag
    if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > kStill) return;
    const hit = hitAt(event.clientX, event.clientY);
    if (byId('measure').checked) measureTo(hit); else showChosen(hit);
    draw();
  });

  // -- The plan
  const plans = data.plans.map((plan) => ({ ...plan, note: textOf(plan.note), runs: bytesOf(plan.runs) }));
  function showPlan(plan) {
    const canvas = byId('plan'), g = canvas.getContext('2d'), cells = document.createElement('canvas');
    const scale = Math.max(1, Math.floor(672 / plan.width));  // of the lines; twice the width on the page
    cells.width = plan.width;
    cells.height = plan.height;
    canvas.width = scale * plan.width;
    canvas.height = scale * plan.height;
    const image = g.createImageData(plan.width, plan.height), shades = [254, 0, 205];  // free, occupied, unknown
    let cell = 0;
    for (let at = 0; at < plan.runs.length; at += 3)
      for (let left = plan.runs[at + 1] + 256 * plan.runs[at + 2]; left > 0; --left, ++cell) {
        const x = cell % plan.width, y = plan.height - 1 - Math.floor(cell / plan.width);
        const pixel = 4 * (y * plan.width + x), shade = shades[plan.runs[at]];
        image.data.set([shade, shade, shade, 255], pixel);
      }
    cells.getContext('2d').putImageData(image, 0, 0);
    g.imageSmoothingEnabled = false;
    g.drawImage(cells, 0, 0, canvas.width, canvas.height);
    g.strokeStyle = '#c02020';
    g.lineWidth = Math.max(1, canvas.width / 250);
    g.beginPath();
    const place = new THREE.Vector3();
    for (let i = 0; i < path.length / 3; ++i) {
      place.fromArray(path, 3 * i).applyQuaternion(turnToUp);
      g.lineTo(scale * (place.x - plan.origin[0]) / plan.cell, canvas.height - scale * (place.y - plan.origin[1]) / plan.cell);
    }
    g.stroke();
    byId('plan-note').textContent = 'Black: occupied, white: free, gray: unknown; a pixel is ' + metres(plan.cell) + '. ' + plan.note;
  }
  if (plans.length > 0) {
    byId('plan-part').hidden = false;
    plans.forEach((plan, i) => byId('storey').add(new Option('floor at ' + plan.floor.toFixed(2) + ' m', i)));
    byId('storey').value = data.storey;
    showPlan(plans[data.storey]);
    byId('storey').addEventListener('change', () => showPlan(plans[+byId('storey').value]));
    byId('plan').addEventListener('click', (event) => {  // the view turns about what is clicked
      const plan = plans[+byId('storey').value], box = byId('plan').getBoundingClientRect();
      const to = new THREE.Vector3(plan.origin[0] + plan.cell * plan.width * (event.clientX - box.left) / box.width,
        plan.origin[1] + plan.cell * plan.height * (1 - (event.clientY - box.top) / box.height), plan.floor);
      camera.position.add(to).sub(controls.target);
      controls.target.copy(to);
      controls.update();
      draw();
    });
  }

  // -- Switches
  if (!data.sides) {  // normals do not say from where a plane was seen
    byId('see-through').checked = false;
    occupiedMesh.material.uniforms.hideBacks.value = 0;
  }
  const onChange = (id, act) => byId(id).addEventListener('change', () => { act(byId(id)); draw(); });
  onChange('show-occupied', (box) => { occupiedMesh.visible = box.checked; });
  onChange('show-unknown', (box) => { unknownMesh.visible = box.checked; });
  onChange('show-path', (box) => { pathLine.visible = box.checked; });
  onChange('see-through', (box) => { occupiedMesh.material.uniforms.hideBacks.value = box.checked ? 1 : 0; });
  onChange('colour', (box) => colourBy(box.value));
  onChange('measure', () => { start = null; });
  byId('reset').addEventListener('click', () => { showAll(); draw(); });
  controls.addEventListener('change', draw);
  window.addEventListener('resize', fit);
  fit();
  showAll();
  draw();

  // -- page.html#selftest clicks the cuboid in the middle and says what came of it, for tests.
  function selfTest() {
    const report = { webgl: !!renderer, cuboids: occupied.count, unknown: unknown.count, plans: plans.length };
    if (renderer) {
      drawNow();
      const box = view.getBoundingClientRect();
      const click = (x, y) => {
        for (const type of ['pointerdown', 'pointerup', 'click'])
          view.dispatchEvent(new MouseEvent(type, { clientX: x, clientY: y, bubbles: true }));
      };
      const seen = [];
      for (let i = 0; i < occupied.count; ++i) {
        const place = inWorld(occupied, i).project(camera);
        seen.push({ i, x: box.left + box.width * (place.x + 1) / 2, y: box.top + box.height * (1 - place.y) / 2, off: Math.hypot(place.x, place.y) });
      }
      seen.sort((a, b) => a.off - b.off);
      const target = seen.find((s) => { const hit = hitAt(s.x, s.y); return hit && hit.index === s.i; });
      if (target) {
        click(target.x, target.y);
        report.clicked = target.i;
        report.shown = [...byId('chosen').querySelectorAll('tr')].map((row) => [...row.cells].map((cell) => cell.textContent));
        const other = [...seen].reverse().find((s) => { const hit = hitAt(s.x, s.y); return hit && hit.index === s.i; });
        byId('measure').checked = true;
        click(target.x, target.y);
        const from = start.toArray();
        click(other.x, other.y);
        byId('measure').checked = false;
        report.measured = { from, to: [...measureLine.geometry.attributes.position.array.slice(3)], text: byId('chosen').textContent };
        world.remove(measureLine);
        chosenBox.visible = false;
      }
      const gl = renderer.getContext();
      const pixel = new Uint8Array(4);
      const kFrames = 5;
      const began = performance.now();
      for (let i = 0; i < kFrames; ++i) {
        drawNow();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);  // waits for the picture
      }
      report.frame_ms = (performance.now() - began) / kFrames;
      pathLine.visible = false;
      drawNow();
      camera.updateMatrixWorld();
      report.camera = camera.position.toArray();
      report.calls = renderer.info.render.calls;
      report.picture = view.toDataURL('image/png');
      report.matrix = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).elements;
    }
    report.errors = errors;
    const out = document.createElement('pre');
    out.id = 'selftest';
    out.hidden = true;
    out.textContent = JSON.stringify(report);
    document.body.append(out);
  }
  if (location.hash === '#selftest') selfTest();
}());
