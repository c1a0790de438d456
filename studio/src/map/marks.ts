// Landmarks, control points, events, faults and further layers as features of the map.
import { exchangedWith } from '../state/exchanged';
import Feature from 'ol/Feature';
import { LineString, Point, Polygon } from 'ol/geom';
import { Circle, Fill, RegularShape, Stroke, Style, Text } from 'ol/style';
import type { ControlPoint, EventStyle, Fault, Feature as LayerFeature, Landmark, WalkEvent } from '../api/model';
import { said } from '../words/sentences';
import { clock, named, number, t } from '../words/words.svelte';
import { type Placing, at } from './affine';
import { DASHES, DISTINCT, lighter } from './colours';
import { type Entry, explain } from './legend';
import type { Move } from './moves';

export interface Mark {
  kind: 'landmark' | 'control';
  floor: number;
  id: string;
}

const SEVERITY = { info: '#0072b2', warning: '#e69f00', error: '#d55e00' };

/** The rectangle between two opposite corners on the map. */
export const rectangle = ([x0, y0]: number[], [x1, y1]: number[]): Polygon => new Polygon([[[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]]);

/** Where a landmark or control point is, with the corrections; null: nowhere. */
export const placeOf = (point: Landmark | ControlPoint): [number, number] | null =>
  point.corrected ? [point.corrected[0], point.corrected[1]] : point.x === null || point.y === null ? null : [point.x, point.y];

function label(text: string, dark: boolean, offset = -15): Text {
  return new Text({
    text,
    font: '600 12px system-ui, sans-serif',
    offsetY: offset,
    fill: new Fill({ color: dark ? '#e6edf3' : '#24292f' }),
    stroke: new Stroke({ color: dark ? '#0d1117' : '#fff', width: 3 }),
  });
}

function pointFeature(kind: Mark['kind'], point: Landmark | ControlPoint, placing: Placing, dark: boolean, chosen: Mark | null): Feature[] {
  const placed = placing.get(point.floor);
  const place = placeOf(point);
  if (!placed || !place) return [];
  const feature = new Feature(new Point(at(placed, ...place)));
  const mark: Mark = { kind, floor: point.floor, id: point.id };
  feature.set('mark', mark);
  const isChosen = chosen?.kind === kind && chosen.floor === point.floor && chosen.id === point.id;
  const excluded = 'excluded' in point && point.excluded;
  const entry = pointEntry(kind, point.corrected !== null || (kind === 'landmark' && exchangedWith(point).length > 0), excluded);
  const { colour } = entry;
  const radius = kind === 'landmark' ? (isChosen ? 10 : 7) : isChosen ? 9 : 6;
  const shape = new RegularShape({
    points: kind === 'landmark' ? 4 : 3,
    angle: kind === 'landmark' ? Math.PI / 4 : 0,
    radius,
    declutterMode: 'none',
    fill: new Fill({ color: excluded ? `${colour}50` : colour }),
    stroke: new Stroke({ color: isChosen ? (dark ? '#fff' : '#000') : '#fff', width: isChosen ? 2.5 : 1 }),
  });
  feature.setStyle(new Style({ image: shape, text: label(point.id, dark), zIndex: isChosen ? 2 : 1 }));
  const seen = 'seen_in' in point ? ` · ${t('tip.seen_in', { count: point.seen_in })}` : '';
  return [explain(feature, entry, `${entry.text} ${point.id} · ${placeText(place)}${seen}`)];
}

/** Coordinates on a floor as text (m). */
export const placeText = ([x, y]: number[], digits = 2): string => t('map.at', { x: number(x, digits), y: number(y, digits) });

function pointEntry(kind: Mark['kind'], corrected: boolean, excluded: boolean): Entry {
  if (kind === 'control') return { key: 'control', text: t('legend.control'), symbol: 'triangle', colour: '#009e73' };
  if (excluded) return { key: 'excluded', text: t('legend.excluded'), symbol: 'diamond', colour: '#808080' };
  if (corrected) return { key: 'corrected', text: t('legend.corrected'), symbol: 'diamond', colour: '#d55e00' };
  return { key: 'landmark', text: t('legend.landmark'), symbol: 'diamond', colour: '#6639ba' };
}

/** A landmark that is planned, not hung yet. */
export function plannedFeature({ id, x, y }: { id: string; x: number; y: number }, isChosen: boolean, dark: boolean): Feature {
  const feature = new Feature(new Point([x, y]));
  const shape = new RegularShape({
    points: 4,
    angle: Math.PI / 4,
    radius: isChosen ? 12 : 9,
    declutterMode: 'none',
    fill: new Fill({ color: '#fff' }),
    stroke: new Stroke({ color: isChosen ? '#d55e00' : '#6639ba', width: 3 }),
  });
  feature.setStyle(new Style({ image: shape, text: label(id, dark, -17), zIndex: isChosen ? 4 : 3 }));
  return feature;
}

export function pointFeatures(landmarks: Landmark[], control: ControlPoint[], placing: Placing, dark: boolean, chosen: Mark | null): Feature[] {
  return [
    ...control.flatMap((point) => pointFeature('control', point, placing, dark, chosen)),
    ...landmarks.flatMap((point) => pointFeature('landmark', point, placing, dark, chosen)),
  ];
}

export function eventFeatures(events: WalkEvent[], styles: EventStyle[], placing: Placing): Feature[] {
  return events.flatMap((event) => {
    const placed = event.floor === null ? undefined : placing.get(event.floor);
    if (!placed || event.x === null || event.y === null) return [];
    const feature = new Feature(new Point(at(placed, event.x, event.y)));
    const colour = styles.find(({ kind }) => kind === event.kind)?.colour ?? '#6e7781';
    feature.setStyle(new Style({ image: new RegularShape({ points: 3, radius: 7, angle: Math.PI, declutterMode: 'none', fill: new Fill({ color: '#fff' }), stroke: new Stroke({ color: colour, width: 2.5 }) }) }));
    feature.set('t', event.t);
    const text = named('event', event.kind);
    return [explain(feature, { key: `event:${event.kind}`, text, symbol: 'event', colour }, `${text} · ${clock(event.t)}`)];
  });
}

export function faultFeatures(faults: Fault[], placing: Placing): Feature[] {
  return faults.flatMap((fault) => fault.places.flatMap((place) => {
    const placed = placing.get(place.floor);
    if (!placed) return [];
    const from = at(placed, place.x, place.y);
    const ring = new Feature(new Point(from));
    ring.setStyle(new Style({ image: new Circle({ radius: 14, declutterMode: 'none', stroke: new Stroke({ color: SEVERITY.error, width: 3 }) }) }));
    const entry: Entry = { key: 'fault', text: t('legend.fault'), symbol: 'ring', colour: SEVERITY.error };
    const tip = said(fault.summary);
    explain(ring, entry, tip);
    if (place.to_x === null || place.to_y === null) return [ring];
    const arrow = new Feature(new LineString([from, at(placed, place.to_x, place.to_y)]));
    arrow.setStyle(arrowStyle(arrow.getGeometry()!, SEVERITY.error, [6, 5]));
    return [ring, explain(arrow, entry, tip)];
  }));
}

function arrowStyle(line: LineString, color: string, lineDash?: number[]): Style[] {
  const end = line.getLastCoordinate();
  const [before] = line.getCoordinates().slice(-2);
  const rotation = Math.PI / 2 - Math.atan2(end[1] - before[1], end[0] - before[0]);
  return [
    new Style({ stroke: new Stroke({ color, width: 2.5, lineDash }) }),
    new Style({ geometry: new Point(end), image: new RegularShape({ points: 3, radius: 7, rotation, declutterMode: 'none', fill: new Fill({ color }) }) }),
  ];
}

/** An area within its outer ring and without its holes. */
export function areaFeature(rings: number[][][], colour: string): Feature {
  const feature = new Feature(new Polygon(rings));
  feature.setStyle(new Style({ fill: new Fill({ color: `${colour}40` }), stroke: new Stroke({ color: colour, width: 1.5 }) }));
  return feature;
}

/** An arrow between two places of the map. */
export function arrowFeature(from: number[], to: number[]): Feature {
  const line = new LineString([from, to]);
  const feature = new Feature(line);
  feature.setStyle(arrowStyle(line, SEVERITY.error));
  return feature;
}

/** Where a walk was at a moment. */
export function tapFeature(place: number[], text: string, isChosen: boolean, dark: boolean): Feature {
  const feature = new Feature(new Point(place));
  const image = new Circle({ radius: isChosen ? 11 : 8, declutterMode: 'none', fill: new Fill({ color: isChosen ? '#d55e00' : '#0072b2' }), stroke: new Stroke({ color: '#fff', width: 2 }) });
  feature.setStyle(new Style({ image, text: label(text, dark, -18), zIndex: isChosen ? 4 : 3 }));
  return feature;
}

/** Colour and dashes of the possible path of this rank. */
export const pathLook = (rank: number, dark: boolean): { colour: string; dash: number[] | undefined } => ({
  colour: dark ? lighter(DISTINCT[rank % DISTINCT.length]) : DISTINCT[rank % DISTINCT.length],
  dash: DASHES[rank % DASHES.length],
});

/** Where labels of one output are away from those of another, of which the largest is first. */
export function moveFeatures(moves: Move[], placing: Placing): Feature[] {
  const color = '#cc2a8a';
  const entry: Entry = { key: 'moves', text: t('legend.moves', { count: moves.length, metres: number(moves[0]?.metres, 2) }), symbol: 'arrow', colour: color };
  return moves.flatMap(({ floor, from, to, metres }) => {
    const placed = placing.get(floor);
    if (!placed) return [];
    const line = new LineString([at(placed, ...from), at(placed, ...to)]);
    const feature = new Feature(line);
    feature.setStyle(arrowStyle(line, color));
    return [explain(feature, entry, t('tip.move', { metres: number(metres, 2) }))];
  });
}

/** A path that a walk may have taken, with a dot and a text where the walk was at a moment. */
export function pathFeatures(points: number[][], place: number[], text: string, rank: number, faint: boolean, dark: boolean): Feature[] {
  const { colour, dash } = pathLook(rank, dark);
  const color = faint ? `${colour}60` : colour;
  const line = new Feature(new LineString(points));
  line.setStyle([
    new Style({ stroke: new Stroke({ color: dark ? '#0d1117a0' : '#ffffffa0', width: 6 }) }),
    new Style({ stroke: new Stroke({ color, width: 3, lineDash: dash }) }),
  ]);
  const dot = new Feature(new Point(place));
  const image = new Circle({ radius: faint ? 5 : 8, declutterMode: 'none', fill: new Fill({ color }), stroke: new Stroke({ color: '#fff', width: 2 }) });
  dot.setStyle(new Style({ image, text: faint ? undefined : label(text, dark, -18), zIndex: 3 }));
  return [line, dot];
}

/** A point with its name. */
export function dotFeature(place: number[], text: string): Feature {
  const feature = new Feature(new Point(place));
  feature.setStyle(new Style({ image: new Circle({ radius: 5, declutterMode: 'none', fill: new Fill({ color: '#009e73' }), stroke: new Stroke({ color: '#fff', width: 1.5 }) }), text: label(text, false, 14) }));
  return feature;
}

/** Shapes of a layer; one with texts only is shown when zoomed in. */
export function layerFeatures(name: string, title: string, features: LayerFeature[], placing: Placing, dark: boolean): Feature[] {
  return features.flatMap((item) => {
    const placed = placing.get(item.floor);
    if (!placed || !item.coordinates.length) return [];
    const put = (ring: number[][]) => ring.map(([x, y]) => at(placed, x, y));
    const color = item.colour ?? SEVERITY[item.severity];
    const feature =
      item.shape === 'point'
        ? new Feature(new Point(put(item.coordinates)[0]))
        : item.shape === 'line'
          ? new Feature(new LineString(put(item.coordinates)))
          : new Feature(new Polygon([put(item.coordinates), ...item.holes.map(put)]));
    const shape = feature.getGeometry();
    if (shape instanceof LineString) feature.setStyle(arrowStyle(shape, color));
    else if (shape instanceof Polygon) feature.setStyle(new Style({ fill: new Fill({ color: `${color}30` }), stroke: new Stroke({ color: `${color}90`, width: 1 }) }));
    else if (item.label) feature.setStyle(new Style({ text: label(item.label, dark, 0) }));
    else feature.setStyle(new Style({ image: new Circle({ radius: 10, fill: new Fill({ color }) }) })); // seen around a landmark
    const symbol = item.shape === 'line' ? 'arrow' : item.shape === 'area' ? 'area' : item.label ? 'text' : 'dot';
    return [explain(feature, { key: `layer:${name}`, text: title, symbol, colour: color }, item.text && said(item.text))];
  });
}

/** Where an access point is estimated to be. */
export function transmitterFeatures(floor: number, place: number[], placing: Placing): Feature[] {
  const placed = placing.get(floor);
  if (!placed) return [];
  const feature = new Feature(new Point(at(placed, place[0], place[1])));
  feature.setStyle(new Style({ image: new RegularShape({ points: 5, radius: 12, radius2: 5, declutterMode: 'none', fill: new Fill({ color: '#b00020' }), stroke: new Stroke({ color: '#fff', width: 2 }) }) }));
  return [explain(feature, { key: 'transmitter', text: t('legend.transmitter'), symbol: 'star', colour: '#b00020' })];
}

/** The walker at a moment: a dot and, where known, the direction looked in (rad). */
export function walkerFeature(x: number, y: number, heading: number): Feature {
  const feature = new Feature(new Point([x, y]));
  const dot = new Style({ image: new Circle({ radius: 8, fill: new Fill({ color: '#b00020' }), stroke: new Stroke({ color: '#fff', width: 2.5 }) }) });
  const pointer = new RegularShape({ points: 3, radius: 8, displacement: [0, 14], rotation: Math.PI / 2 - heading, rotateWithView: true, fill: new Fill({ color: '#b00020' }) });
  feature.setStyle(Number.isFinite(heading) ? [dot, new Style({ image: pointer })] : dot);
  return feature;
}
