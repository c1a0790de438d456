// The map itself: panning, zooming, touching and dragging by OpenLayers; walks painted from columns.
import Collection from 'ol/Collection';
import type Feature from 'ol/Feature';
import OlMap from 'ol/Map';
import type MapBrowserEvent from 'ol/MapBrowserEvent';
import View from 'ol/View';
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

interface Heard {
  clicked(place: number[], resolution: number, feature: Feature | undefined): void;
  moved(extent: number[]): void;
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
  private readonly marks = new VectorSource();
  private readonly walker = new VectorSource();
  private readonly movable = new Collection<Feature>();
  private swipe: number | null = null;
  private draw: Draw | null = null;

  constructor(target: HTMLElement, heard: Heard) {
    const projection = new Projection({ code: 'site', units: 'm', extent: [-WIDE, -WIDE, WIDE, WIDE] });
    this.main = new Painting(projection);
    this.other = new Painting(projection);
    this.other.show(null);
    const translate = new Translate({ features: this.movable, hitTolerance: 12 });
    this.map = new OlMap({
      target,
      controls: [],
      interactions: defaults({ altShiftDragRotate: false, pinchRotate: false }).extend([translate]),
      layers: [
        this.main.layer,
        this.other.layer,
        new VectorLayer({ source: this.areas }),
        new VectorLayer({ source: this.marks, declutter: true }),
        new VectorLayer({ source: this.walker, updateWhileAnimating: true }),
      ],
      view: new View({ projection, center: [0, 0], resolution: 0.1, minResolution: 0.002, maxResolution: 5, enableRotation: false, smoothExtentConstraint: false }),
    });
    this.map.on('singleclick', (event: MapBrowserEvent) => {
      const feature = this.map.forEachFeatureAtPixel(event.pixel, (found) => found as Feature, { hitTolerance: 10 });
      heard.clicked(event.coordinate, this.view.getResolution()!, feature);
    });
    this.map.on('moveend', () => heard.moved(this.view.calculateExtent()));
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

  setAreas(features: Feature[]): void {
    this.areas.clear();
    this.areas.addFeatures(features);
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

  /** Bring a box [left, low, right, high] into view, from at least a few metres away. */
  fit(box: number[], atOnce = false): void {
    this.map.updateSize();
    const edge = Math.min(40, 0.08 * Math.min(...this.map.getSize()!));
    this.view.fit(box, { padding: [edge, edge, edge, edge], minResolution: 0.02, duration: atOnce ? 0 : 250 });
  }

  middle(): number[] {
    return this.view.getCenter()!;
  }

  zoom(steps: number): void {
    this.view.animate({ zoom: this.view.getZoom()! + steps, duration: 200 });
  }

  /** Pan so that a place is in view; its margin is smaller than that of a box that was brought into view. */
  follow(place: number[]): void {
    const [left, low, right, high] = this.view.calculateExtent();
    const margin = 0.05 * Math.min(right - left, high - low);
    const inside = place[0] > left + margin && place[0] < right - margin && place[1] > low + margin && place[1] < high - margin;
    if (!inside) this.view.animate({ center: place, duration: 200 });
  }
}
