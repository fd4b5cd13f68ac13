// Copyright 2026 The armid_ros developers
// SPDX-License-Identifier: Apache-2.0
// Draws the charts of a page: each figure.chart contains its data as JSON.
'use strict';
(() => {
  const root = document.documentElement;
  const roles = ['measured', 'predicted', 'residual', 'before', 'after', 'floor', 'trend', 'faint',
    'ink', 'soft', 'line', 'grid', 'paper'];
  const widths = {measured: 4, faint: 1.3, trend: 2};
  const font = '12px system-ui, sans-serif';
  const charts = new Map();  // figure -> {plot, spec}
  const hovers = matchMedia('(hover: hover)').matches;  // touch screens always show the buttons
  let colour = {};

  const readColours = () => {
    const style = getComputedStyle(root);
    colour = Object.fromEntries(roles.map((role) => [role, style.getPropertyValue(`--${role}`)]));
  };
  const brief = (value) => (value == null ? '–' : String(Number(value.toPrecision(4))));
  const clear = (name, alpha) => `color-mix(in srgb, ${colour[name]} ${alpha}%, transparent)`;

  function sticks(u, index, first, last) {
    const stroke = new Path2D();
    const zero = u.valToPos(0, 'y', true);
    for (let k = first; k <= last; k++) {
      const x = u.valToPos(u.data[0][k], 'x', true);
      stroke.moveTo(x, zero);
      stroke.lineTo(x, u.valToPos(u.data[index][k], 'y', true));
    }
    return {stroke, fill: null};
  }

  // The curve of a fitted model is dashed, so that the measured curve below it remains visible.
  function seriesOf(entry, measured) {
    const paint = () => colour[entry.role];
    const series = {
      label: entry.label, stroke: paint, width: widths[entry.role] || 1.3,
      points: {show: false}, value: (u, value) => brief(value),
    };
    if (entry.kind === 'points') {
      const pale = () => clear(entry.role, 45);
      Object.assign(series, {paths: () => null,
        points: {show: true, space: 0, size: 4, width: 0, fill: pale, stroke: pale}});
    } else if (entry.kind === 'trend') {
      Object.assign(series, {spanGaps: true, points: {show: true, space: 0, size: 4, fill: paint}});
    } else if (entry.kind === 'sticks') {
      Object.assign(series, {paths: sticks, width: 2});
    } else if (measured && entry.role === 'after') {
      Object.assign(series, {dash: [6, 5], width: 1.6});
    }
    return series;
  }

  function rangeY(spec) {
    return (u, low, high) => {
      if (low == null) return [0, 1];
      for (const level of spec.levels) {
        low = Math.min(low, level.y);
        high = Math.max(high, level.y);
      }
      if (spec.series.some((entry) => entry.kind === 'sticks')) {
        low = Math.min(low, 0);
        high = Math.max(high, 0);
      }
      if (spec.symmetric) {
        high = Math.max(Math.abs(low), Math.abs(high));
        low = -high;
      }
      // Differences of rounding count as zero: six digits of the tick labels would be equal.
      const span = high - low > 1e-5 * Math.max(Math.abs(low), Math.abs(high)) ? high - low : 0;
      const pad = 0.07 * span || 0.1 * Math.abs(high) || 1;
      const flat = (edge) => edge === 0 && !spec.symmetric;
      return [flat(low) ? 0 : low - pad, flat(high) ? 0 : high + pad];
    };
  }

  function rangeX(spec) {
    const [start, end] = [spec.x[0], spec.x[spec.x.length - 1]];
    const exact = spec.series.every((entry) => entry.kind === 'line' || entry.kind === 'band');
    const pad = exact || spec.logarithmic ? 0 : 0.025 * (end - start || 1);
    return (u, low, high) => {
      if (low == null) return [0, 1];
      return low <= start && high >= end ? [start - pad, end + pad] : [low, high];
    };
  }

  // Ticks at 1, 2 and 5 times powers of ten; equal steps if fewer than two of them are visible.
  function decades(u, index, low, high) {
    const found = [];
    for (let power = 10 ** Math.floor(Math.log10(low)); power <= high; power *= 10) {
      found.push(...[1, 2, 5].map((n) => n * power).filter((v) => v >= low && v <= high));
    }
    return found.length > 1 ? found : [0, 1, 2, 3, 4].map((k) => low + (k / 4) * (high - low));
  }

  function axis(label, side, {whole = false, logarithmic = false} = {}) {
    const vertical = side === 3;
    return {
      ...(logarithmic ? {splits: decades, filter: (u, splits) => splits} : {}),
      ...(whole ? {incrs: [1, 2, 5].flatMap((x) => [0, 1, 2, 3, 4, 5].map((n) => x * 10 ** n)).sort((a, b) => a - b)} : {}),
      label: label || null, side, font, labelFont: font, labelSize: 18, labelGap: 0, gap: 4,
      stroke: () => colour.soft,
      size: vertical ? (u, values) => 16 + 7 * Math.max(6, ...(values || []).map((v) => v.length)) : 26,
      // At most a quarter of the axis, so that at least two ticks are visible.
      space: vertical ? (u, index, low, high, length) => Math.min(22, length / 4) : 60,
      values: (u, splits) => splits.map((value) => (value == null ? '' : String(Number(value.toPrecision(6))))),
      grid: {stroke: () => colour.grid, width: 1},
      ticks: {stroke: () => colour.line, width: 1, size: 4},
    };
  }

  function withSoftPen(ctx) {
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = colour.soft;
    ctx.lineWidth = uPlot.pxRatio;
    ctx.font = `${10 * uPlot.pxRatio}px system-ui, sans-serif`;
  }

  // Writes text with an outline, readable on top of a curve.
  function write(ctx, text, x, y) {
    ctx.save();
    ctx.strokeStyle = colour.paper;
    ctx.lineWidth = 3 * uPlot.pxRatio;
    ctx.lineJoin = 'round';
    ctx.strokeText(text, x, y);
    ctx.restore();
    ctx.fillText(text, x, y);
  }

  function drawMarks(spec) {
    return (u) => {
      const {ctx, bbox} = u;
      withSoftPen(ctx);
      ctx.setLineDash([4 * uPlot.pxRatio, 3 * uPlot.pxRatio]);
      for (const mark of spec.marks) {
        const x = u.valToPos(mark.x, 'x', true);
        if (x < bbox.left || x > bbox.left + bbox.width) continue;
        ctx.beginPath();
        ctx.moveTo(x, bbox.top);
        ctx.lineTo(x, bbox.top + bbox.height);
        ctx.stroke();
        const fits = x + ctx.measureText(mark.label).width + 4 * uPlot.pxRatio < bbox.left + bbox.width;
        const left = mark.before || !fits;
        ctx.textAlign = left ? 'right' : 'left';
        const foot = (left && !mark.before ? 18 : 5) * uPlot.pxRatio;
        ctx.fillText(mark.label, x + (left ? -4 : 4) * uPlot.pxRatio, bbox.top + bbox.height - foot);
      }
      ctx.restore();
    };
  }

  function drawLevels(spec) {
    return (u) => {
      const {ctx, bbox} = u;
      withSoftPen(ctx);
      for (const level of spec.levels) {
        const y = u.valToPos(level.y, 'y', true);
        ctx.setLineDash([4 * uPlot.pxRatio, 3 * uPlot.pxRatio]);
        ctx.beginPath();
        ctx.moveTo(bbox.left, y);
        ctx.lineTo(bbox.left + bbox.width, y);
        ctx.stroke();
        ctx.setLineDash([]);
        // Near the top, the text is below the line and on the left, away from the buttons.
        const top = y - bbox.top < 16 * uPlot.pxRatio;
        ctx.textAlign = top ? 'left' : 'right';
        ctx.textBaseline = top ? 'top' : 'bottom';
        const x = top ? bbox.left + 4 * uPlot.pxRatio : bbox.left + bbox.width - 2;
        write(ctx, level.label, x, y + (top ? 3 : -2) * uPlot.pxRatio);
      }
      ctx.restore();
    };
  }

  const peers = (spec) => [...charts.values()].filter((chart) => spec.link && chart.spec.link === spec.link);
  const whole = (spec) => ({min: spec.x[0], max: spec.x[spec.x.length - 1]});

  // Applies the zoom of a chart to its linked charts; equal ranges end the recursion.
  function share(spec, figure) {
    return (u, key) => {
      if (key !== 'x') return;
      const {min, max} = u.scales.x;
      const all = whole(spec);
      const slack = 1e-6 * (all.max - all.min);
      figure.querySelector('.reset').hidden = min <= all.min + slack && max >= all.max - slack;
      for (const {plot} of peers(spec)) {
        const other = plot.scales.x;
        if (plot !== u && (Math.abs(other.min - min) > slack || Math.abs(other.max - max) > slack)) {
          plot.setScale('x', {min, max});
        }
      }
    };
  }

  // Two fingers zoom, one finger moves the zoomed range; a double tap shows the full range.
  function touch(u, spec) {
    const fingers = new Map();
    let lastTap = 0;
    const value = (x) => u.posToVal(x - u.over.getBoundingClientRect().left, 'x');
    const show = (min, max) => {
      const all = whole(spec);
      const span = Math.min(max - min, all.max - all.min);
      const start = Math.max(all.min, Math.min(min, all.max - span));
      u.setScale('x', {min: start, max: start + span});
    };
    u.over.addEventListener('pointerdown', (event) => {
      if (event.pointerType === 'mouse') return;
      fingers.set(event.pointerId, event.clientX);
      if (fingers.size === 1 && event.timeStamp - lastTap < 300) show(whole(spec).min, whole(spec).max);
      lastTap = event.timeStamp;
    });
    u.over.addEventListener('pointermove', (event) => {
      if (!fingers.has(event.pointerId)) return;
      const before = [...fingers.values()].map(value);
      fingers.set(event.pointerId, event.clientX);
      const after = [...fingers.values()].map(value);
      const {min, max} = u.scales.x;
      if (fingers.size === 1) {
        show(min + before[0] - after[0], max + before[0] - after[0]);
      } else if (Math.abs(after[0] - after[1]) > 1e-9 * (max - min)) {
        const ratio = Math.abs((before[0] - before[1]) / (after[0] - after[1]));
        const [old, now] = [(before[0] + before[1]) / 2, (after[0] + after[1]) / 2];
        const start = old - (now - min) * ratio;
        show(start, start + (max - min) * ratio);
      }
    });
    for (const end of ['pointerup', 'pointercancel', 'pointerleave']) {
      u.over.addEventListener(end, (event) => fingers.delete(event.pointerId));
    }
  }

  const quoted = (text) => `"${text.trim().replace(/\s+/g, ' ').replace(/"/g, '""')}"`;

  function numbers(spec) {
    const columns = [[spec.xlabel || 'x', spec.x]];
    for (const {label, y, upper} of spec.series) {
      columns.push([`${label}: ${spec.ylabel}`, y], ...(upper ? [[`${label}, upper edge`, upper]] : []));
    }
    const rows = spec.x.map((x, k) => columns.map(([, values]) => values[k] ?? '').join(','));
    return [columns.map(([label]) => quoted(label)).join(','), ...rows].join('\n');
  }

  function picture(plot) {
    const {width, height} = plot.ctx.canvas;
    const canvas = Object.assign(document.createElement('canvas'), {width, height});
    const ctx = canvas.getContext('2d');
    ctx.fillStyle = colour.paper;
    ctx.fillRect(0, 0, width, height);
    ctx.drawImage(plot.ctx.canvas, 0, 0);
    return canvas.toDataURL();
  }

  function addDownload(figure, kind, title, address) {
    const button = Object.assign(document.createElement('button'), {type: 'button', className: 'tool', textContent: kind, title});
    button.addEventListener('click', () => {
      Object.assign(document.createElement('a'), {href: address(), download: `chart.${kind.toLowerCase()}`}).click();
    });
    figure.querySelector('.tools').append(button);
  }

  function draw(figure) {
    if (charts.has(figure) || !figure.clientWidth) return;
    const spec = JSON.parse(figure.querySelector('script').textContent);
    const data = [spec.x];
    const series = [{label: spec.xlabel || 'at', value: (u, value) => brief(value)}];
    const bands = [];
    const measured = spec.series.some((entry) => entry.role === 'measured');
    for (const entry of spec.series) {
      if (entry.kind === 'band') {
        const edge = {label: entry.label, stroke: () => 'transparent', points: {show: false}};
        series.push({...edge, class: 'u-band'}, {...edge, class: 'u-edge'});
        data.push(entry.upper, entry.y);
        bands.push({series: [series.length - 2, series.length - 1], fill: () => clear(entry.role, 25)});
      } else {
        series.push(seriesOf(entry, measured));
        data.push(entry.y);
      }
    }
    const plot = new uPlot({
      width: figure.clientWidth, height: spec.height, series, bands, padding: [spec.legend || hovers ? 8 : 26, 12, 0, 0],
      scales: {x: {time: false, range: rangeX(spec), distr: spec.logarithmic ? 3 : 1}, y: {range: rangeY(spec)}},
      axes: [axis(spec.xlabel, 2, {whole: spec.x.every(Number.isInteger), logarithmic: spec.logarithmic}),
        axis(spec.ylabel, 3)],
      legend: {show: spec.legend, markers: {width: 3}},
      cursor: {y: false, drag: {x: true, y: false}, points: {size: 6},
        ...(spec.link ? {sync: {key: spec.link, scales: ['x', null]}} : {})},
      hooks: {draw: [drawLevels(spec), drawMarks(spec)], setScale: [share(spec, figure)],
        ready: [(u) => u.root.classList.add('idle')],
        setLegend: [(u) => u.root.classList.toggle('idle', u.cursor.idx == null)]},
    }, data, figure);
    charts.set(figure, {plot, spec});
    addDownload(figure, 'PNG', 'picture of the chart', () => picture(plot));
    addDownload(figure, 'CSV', 'numbers of the curves, as drawn',
      () => `data:text/csv;charset=utf-8,${encodeURIComponent(numbers(spec))}`);
    touch(plot, spec);
    figure.querySelector('.reset').addEventListener('click', () => plot.setScale('x', whole(spec)));
    resizing.observe(figure);
  }

  const resizing = new ResizeObserver((entries) => {
    for (const {target, contentRect} of entries) {
      const chart = charts.get(target);
      const width = Math.floor(contentRect.width);
      if (width && Math.abs(width - chart.plot.width) > 1) {
        chart.plot.setSize({width, height: chart.spec.height});
      }
    }
  });

  function drawAll() {
    const started = performance.now();
    document.querySelectorAll('figure.chart').forEach(draw);
    root.dataset.charts = charts.size;
    root.dataset.drawMilliseconds = Math.round(performance.now() - started);
  }

  const repaint = () => {
    readColours();
    charts.forEach(({plot}) => plot.redraw(false, true));
  };

  window.addEventListener('beforeprint', () => {
    root.classList.add('paper');
    repaint();
  });
  window.addEventListener('afterprint', () => {
    root.classList.remove('paper');
    repaint();
  });

  // A button below each table copies the table as CSV; a field filters rows of parameters.
  const csv = (table) => [...table.rows].map(
    (row) => [...row.cells].map((cell) => quoted(cell.innerText.replaceAll('\u00a0', ' '))).join(',')).join('\n');

  function addCopy(table) {
    const button = document.createElement('button');
    Object.assign(button, {type: 'button', className: 'tool', textContent: 'copy as CSV'});
    button.addEventListener('click', async () => {
      await navigator.clipboard.writeText(csv(table));
      button.textContent = 'copied';
    });
    table.parentElement.after(button);
  }

  function addFilter(section) {
    const field = document.createElement('input');
    Object.assign(field, {type: 'search', className: 'tool', placeholder: 'filter parameters'});
    field.setAttribute('aria-label', 'Filter parameters');
    const rows = [...section.querySelectorAll('table.parameters tbody tr')];
    const words = (row) => (row.closest('details').firstElementChild.textContent + row.textContent).toLowerCase();
    const keeps = {known: (row) => !row.querySelector('.unknown'), changed: (row) => row.querySelector('.changed')};
    const tools = [field];
    const apply = () => {
      const chosen = tools.slice(1).filter((tool) => tool.ariaPressed === 'true').map((tool) => keeps[tool.textContent]);
      for (const row of rows) {
        row.hidden = !words(row).includes(field.value.toLowerCase()) || !chosen.every((keep) => keep(row));
      }
      for (const fold of section.querySelectorAll('details:has(> .scroll > table.parameters)')) {
        fold.hidden = !fold.querySelector('tbody tr:not([hidden])');
      }
    };
    field.addEventListener('input', apply);
    for (const [name, keep] of Object.entries(keeps)) {
      const left = rows.filter(keep).length;
      if (!left || left === rows.length) continue;
      const button = document.createElement('button');
      Object.assign(button, {type: 'button', className: 'tool', textContent: name, ariaPressed: 'false'});
      button.addEventListener('click', () => {
        button.ariaPressed = String(button.ariaPressed !== 'true');
        apply();
      });
      tools.push(button);
    }
    section.querySelector('details').before(...tools);
  }

  // Keeps a number and its unit on one line.
  function keepUnits() {
    for (const block of document.querySelectorAll('p, li, dd, td')) {
      const walk = document.createTreeWalker(block, NodeFilter.SHOW_TEXT);
      while (walk.nextNode()) {
        const text = walk.currentNode;
        text.data = text.data.replace(/(\d) (?=%|°|(?:N|[kmc]?m|k?g|m?s|m?rad|k?Hz|dB)\b)/g, '$1\u00a0')
          .replace(/\b(k?N|kg) m/g, '$1\u00a0m')
          .replace(/ ± /g, block.tagName === 'TD' ? ' ±\u00a0' : '\u00a0±\u00a0');
      }
    }
  }

  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', repaint);
  document.querySelectorAll('details').forEach((details) => details.addEventListener('toggle', drawAll));
  document.querySelectorAll('.scroll > table').forEach(addCopy);
  document.querySelectorAll('section:has(table.parameters)').forEach(addFilter);
  keepUnits();
  readColours();
  drawAll();
})();
