// The map itself: panning, zooming, touching and dragging by OpenLayers; walks painted from columns.
import Collection from 'ol/Collection';
import type Feature from 'ol/Feature';
import OlMap from 'ol/Map';
import type MapBrowserEvent from 'ol/MapBrowserEvent';
import Overlay from 'ol/Overlay';
import View from 'ol/View';
import ScaleLine from 'ol/control/ScaleLine';
import { defaults } from 'ol/interaction/defaults';
import Draw from 'ol/interaction/Draw';
import Translate from 'ol/interaction/Translate';
import ImageLayer from 'ol/layer/Image';
import VectorLayer from 'ol/layer/Vector';
import { LineString, Point, Polygon } from 'ol/geom';
import Projection from 'ol/proj/Projection';
import { getRenderPixel } from 'ol/render';
import type RenderEvent from 'ol/render/Event';
import ImageCanvas from 'ol/source/ImageCanvas';
import VectorSource from 'ol/source/Vector';
import { Circle, Fill, Stroke, Style } from 'ol/style';
import type { Mark } from './marks';
import { type Picture, paint } from './paint';

const WIDE = 1e5;
/** Names of rooms are shown from here on (m per pixel). */
const ROOM_RESOLUTION = 0.08;
/** Times of animations are multiplied by this: none for those who asked for less motion. */
const MOTION = matchMedia('(prefers-reduced-motion: reduce)').matches ? 0 : 1;
/** The pointer rests after so long (ms). */
const REST_MS = 60;

interface Heard {
  clicked(place: number[], resolution: number, feature: Feature | undefined): void;
  /** The pointer is at a place; null: it left the map. */
  pointed(place: number[] | null): void;
  /** The pointer rests at a place. */
  rested(place: number[], resolution: number, feature: Feature | undefined): void;
  moved(extent: number[], resolution: number): void;
  dragged(mark: Mark, place: number[]): void;
}

class Painting {
  picture: Picture | null = null;
  readonly layer: ImageLayer<ImageCanvas>;
  private readonly source: ImageCanvas;

  constructor(projection: Projection) {
    this.source = new ImageCanvas({
      projection,
      ratio: 1.4,
      canvasFunction: (extent, resolution, ratio, size) => {
        const canvas = document.createElement('canvas');
        [canvas.width, canvas.height] = size.map(Math.round);
        // Read often: kept in main memory, where drawing thousands of short lines is quick without a graphics processor.
        const context = canvas.getContext('2d', { willReadFrequently: true })!;
        if (this.picture) paint(context, this.picture, extent, ratio / resolution);
        return canvas;
      },
    });
    this.layer = new ImageLayer({ source: this.source });
  }

  show(picture: Picture | null): void {
    this.picture = picture;
    this.layer.setVisible(picture !== null);
    this.source.changed();
  }
}

export class SiteMap {
  readonly map: OlMap;
  private readonly main: Painting;
  private readonly other: Painting;
  private readonly areas = new VectorSource();
  private readonly names = new VectorSource();
  private readonly marks = new VectorSource();
  private readonly walker = new VectorSource();
  private readonly movable = new Collection<Feature>();
  private swipe: number | null = null;
  private draw: Draw | null = null;
  private readonly tip: Overlay;
  /** The box that was brought into view last, until the map is moved otherwise, and the view that showed it. */
  private home: { box: number[]; isWhole: boolean; view: string | null } | null = null;

  /** `covered` says how much of each edge (top, right, bottom, left; pixels) is behind what lies on the map. */
  constructor(
    target: HTMLElement,
    tip: HTMLElement,
    private readonly covered: () => number[],
    heard: Heard,
  ) {
    const projection = new Projection({ code: 'site', units: 'm', extent: [-WIDE, -WIDE, WIDE, WIDE] });
    this.main = new Painting(projection);
    this.other = new Painting(projection);
    this.other.show(null);
    const translate = new Translate({ features: this.movable, hitTolerance: 12 });
    this.map = new OlMap({
      target,
      controls: [new ScaleLine({ minWidth: 70 })],
      overlays: [(this.tip = new Overlay({ element: tip, stopEvent: false }))],
      interactions: defaults({ altShiftDragRotate: false, pinchRotate: false }).extend([translate]),
      layers: [
        this.main.layer,
        this.other.layer,
        new VectorLayer({ source: this.areas }),
        new VectorLayer({ source: this.names, declutter: true, maxResolution: ROOM_RESOLUTION }),
        new VectorLayer({ source: this.marks, declutter: true }),
        new VectorLayer({ source: this.walker, updateWhileAnimating: true }),
      ],
      view: new View({ projection, center: [0, 0], resolution: 0.1, minResolution: 0.002, maxResolution: 5, enableRotation: false, smoothExtentConstraint: false }),
    });
    const featureAt = (pixel: number[], hitTolerance: number) => this.map.forEachFeatureAtPixel(pixel, (found) => found as Feature, { hitTolerance });
    this.map.on('singleclick', (event: MapBrowserEvent) => heard.clicked(event.coordinate, this.view.getResolution()!, featureAt(event.pixel, 10)));
    let rest: ReturnType<typeof setTimeout> | undefined;
    this.map.on('pointermove', ({ coordinate, pixel, dragging }: MapBrowserEvent) => {
      clearTimeout(rest);
      if (dragging) return;
      heard.pointed(coordinate);
      rest = setTimeout(() => heard.rested(coordinate, this.view.getResolution()!, featureAt(pixel, 4)), REST_MS);
    });
    target.addEventListener('pointerleave', () => {
      clearTimeout(rest);
      heard.pointed(null);
    });
    this.map.on('moveend', () => heard.moved(this.view.calculateExtent(), this.view.getResolution()!));
    this.map.on('change:size', () => this.fitAgain());
    translate.on('translating', ({ features }) => this.dragTo(features.item(0) as Feature, false));
    translate.on('translateend', ({ features }) => {
      const feature = features.item(0) as Feature;
      this.dragTo(feature, true);
      if (feature.get('mark')) heard.dragged(feature.get('mark') as Mark, (feature.getGeometry() as Point).getCoordinates());
    });
    this.other.layer.on('prerender', (event) => this.clip(event));
    this.other.layer.on('postrender', (event) => (event.context as CanvasRenderingContext2D).restore());
    this.main.layer.on('prerender', (event) => this.clip(event));
    this.main.layer.on('postrender', (event) => (event.context as CanvasRenderingContext2D).restore());
  }

  private dragTo(feature: Feature, ended: boolean): void {
    const drag = feature.get('drag') as ((place: number[], ended: boolean) => void) | undefined;
    drag?.((feature.getGeometry() as Point).getCoordinates(), ended);
  }

  private get view(): View {
    return this.map.getView();
  }

  /** Keep the main picture left of the swiped line, the other right of it. */
  private clip(event: RenderEvent): void {
    const context = event.context as CanvasRenderingContext2D;
    context.save();
    if (this.swipe === null) return;
    const [width, height] = this.map.getSize()!;
    const line = width * this.swipe;
    const [from, to] = event.target === this.main.layer ? [0, line] : [line, width];
    const corners = [[from, 0], [to, 0], [to, height], [from, height]].map((corner) => getRenderPixel(event, corner));
    context.beginPath();
    corners.forEach(([x, y], number) => (number ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.closePath();
    context.clip();
  }

  paint(picture: Picture | null, other: Picture | null): void {
    this.main.show(picture);
    this.other.show(other);
  }

  setSwipe(share: number | null): void {
    this.swipe = share;
    this.map.render();
  }

  /** Areas and lines below the marks, and names that are shown when zoomed in. */
  setAreas(features: Feature[], names: Feature[]): void {
    this.areas.clear();
    this.areas.addFeatures(features);
    this.names.clear();
    this.names.addFeatures(names);
  }

  /** Put the text of what is pointed at beside a place, where there is room; null: nowhere. */
  setTip(place: number[] | null): void {
    this.tip.setPosition(place ?? undefined);
    if (!place) return;
    const [[x, y], [width]] = [this.map.getPixelFromCoordinate(place), this.map.getSize()!];
    const below = y < 90;
    const side = x < width / 3 ? 'left' : x > (2 * width) / 3 ? 'right' : 'center';
    this.tip.setPositioning(`${below ? 'top' : 'bottom'}-${side}`);
    this.tip.setOffset([0, below ? 14 : -12]);
  }

  /** Marks to click on; those for which `movable` holds can be dragged, and those with a function `drag`. */
  setMarks(features: Feature[], movable: (mark: Mark) => boolean): void {
    this.marks.clear();
    this.marks.addFeatures(features);
    this.movable.clear();
    this.movable.extend(features.filter((feature) => feature.get('drag') || (feature.get('mark') && movable(feature.get('mark') as Mark))));
  }

  /** Let lines be drawn by a brush, or polygons corner by corner; null: nothing is drawn any more. */
  setDrawing(drawing: { shape: 'brush' | 'polygon'; colour: string; done(points: number[][]): void } | null): void {
    if (this.draw) this.map.removeInteraction(this.draw);
    this.draw = null;
    if (!drawing) return;
    const { shape, colour, done } = drawing;
    const image = new Circle({ radius: 5, fill: new Fill({ color: colour }) });
    const style = new Style({ image, stroke: new Stroke({ color: colour, width: 4 }), fill: new Fill({ color: `${colour}40` }) });
    this.draw = new Draw({ type: shape === 'brush' ? 'LineString' : 'Polygon', freehand: shape === 'brush', style });
    this.draw.on('drawend', ({ feature }) => {
      const drawn = feature.getGeometry();
      if (drawn instanceof LineString) done(drawn.getCoordinates());
      if (drawn instanceof Polygon) done(drawn.getCoordinates()[0].slice(0, -1));
    });
    this.map.addInteraction(this.draw);
  }

  setWalker(feature: Feature | null): void {
    this.walker.clear();
    if (feature) this.walker.addFeature(feature);
  }

  /** Bring a box [left, low, right, high] into view, from at least a few metres away; again if the map's size changes before it is moved. A whole floor may be behind the legend, a part of it may not. */
  fit(box: number[], isWhole: boolean, atOnce = false): void {
    const home = { box, isWhole, view: null as string | null };
    this.home = home;
    this.view.cancelAnimations();
    const size = this.map.getSize();
    if (!size?.every(Boolean)) return; // it is fitted once it has a size
    const edge = Math.min(40, 0.08 * Math.min(...size));
    const padding = (isWhole ? [0, 0, 0, 0] : this.covered()).map((covered, side) => Math.min(edge + covered, 0.35 * size[(side + 1) % 2]));
    const callback = (complete: boolean) => {
      if (this.home !== home) return;
      home.view = this.here();
      if (!complete) this.home = null; // the map was moved on the way
    };
    this.view.fit(box, { padding, minResolution: 0.02, duration: atOnce ? 0 : 250 * MOTION, callback });
  }

  /** To be called when covered edges have changed: they do not concern a whole floor. */
  coverChanged(): void {
    if (this.home && !this.home.isWhole) this.fitAgain();
  }

  /** What was brought into view stays there, unless the map was moved since. */
  private fitAgain(): void {
    if (!this.home || !this.map.getSize()?.every(Boolean)) return;
    if (this.home.view === null || this.home.view === this.here()) this.fit(this.home.box, this.home.isWhole, true);
    else this.home = null;
  }

  private here(): string {
    return `${this.view.getCenter()!.join(' ')} ${this.view.getResolution()}`;
  }

  middle(): number[] {
    return this.view.getCenter()!;
  }

  /** As if the pointer rested at the middle, for the keyboard. */
  look(heard: Heard['rested']): void {
    const [middle, pixel] = [this.middle(), this.map.getPixelFromCoordinate(this.middle())];
    heard(middle, this.view.getResolution()!, this.map.forEachFeatureAtPixel(pixel, (found) => found as Feature, { hitTolerance: 10 }));
  }

  zoom(steps: number): void {
    this.view.animate({ zoom: this.view.getZoom()! + steps, duration: 200 * MOTION });
  }

  /** Pan so that a place is in view; its margin is smaller than that of a box that was brought into view. */
  follow(place: number[]): void {
    if (this.home?.view === null) return; // on the way to a box
    const [left, low, right, high] = this.view.calculateExtent();
    const margin = 0.05 * Math.min(right - left, high - low);
    const inside = place[0] > left + margin && place[0] < right - margin && place[1] > low + margin && place[1] < high - margin;
    if (!inside) this.view.animate({ center: place, duration: 200 * MOTION });
  }
}
