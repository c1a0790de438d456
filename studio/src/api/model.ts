// Short names of what the server answers, generated from its description (npm run openapi).
import type { components } from './schema';

type Schemas = components['schemas'];

export type Floor = Schemas['FloorView'];
export type Landmark = Schemas['LandmarkView'];
export type ControlPoint = Schemas['ControlPointView'];
export type StatusStyle = Schemas['StatusView'];
export type EventStyle = Schemas['EventKindView'];
export type Survey = Schemas['SurveyView'];
export type Session = Schemas['SessionView'];
export type SessionDetail = Schemas['SessionDetail'];
export type PlacedOnPlan = Schemas['PlacingView'];
export type Candidate = Schemas['CandidateView'];
export type Tap = Schemas['TapView'];
export type Taps = Schemas['TapsView'];
export type WalkEvent = Schemas['EventView'];
export type Corrections = Schemas['CorrectionsView'];
export type Entry = Schemas['Entry'];
export type CorrectionTable = Schemas['CorrectionTable'];
export type Change = Schemas['PreviewRequest']['changes'][number];
export type Undone = Schemas['Undone'];
export type Conflict = Schemas['Conflict'];
export type Preview = Schemas['Preview'];
export type Job = Schemas['Job'];
export type Fault = Schemas['FaultView'];
export type Diagnosis = Schemas['DiagnosisView'];
export type Comparison = Schemas['ComparisonView'];
export type Radio = Schemas['RadioView'];
export type RadioFloor = Schemas['RadioFloor'];
export type RadioPoint = Schemas['RadioPoint'];
export type Collecting = Schemas['CollectingView'];
export type Covered = Schemas['Covered'];
export type Shared = Schemas['SharedView'];
export type SharedFolder = Schemas['SharedFolder'];
export type LayerInfo = Schemas['LayerInfo'];
export type Feature = Schemas['Feature'];
export type Problem = Schemas['Problem'];
export type Versions = Schemas['Versions'];
export type DroppedFile = Schemas['DroppedFile'];
export type PlanLook = Schemas['PlanLookView'];
type PlanSource = Schemas['PlanSource'];
/** What is left out is as the file says. */
export interface FloorRequest {
  file: number;
  whole: boolean;
  part: { number: number; name: string; plan: Pick<PlanSource, 'file' | 'page' | 'area'> & { distance?: { from: number[]; to: number[]; metres: number }; scale?: { one_to: number } } };
}
export type AddedFloor = Schemas['AddedFloor'];
export type FloorChange = Schemas['FloorChange'];
export type ChangedFloor = Schemas['ChangedFloor'];
export type PlanWish = Schemas['PlanWish'];
export type PlanChange = Schemas['PlanChange'];
export type Planned = Schemas['PlannedView'];
export type Written = Schemas['Written'];
export type SheetsWish = Schemas['SheetsWish'];
export type Sheets = Schemas['SheetsView'];
export type RegisterWish = Schemas['RegisterRequest'];
export type Registered = Schemas['RegistrationView'];
export type WallsWish = Schemas['WallsRequest'];
export type Walls = Schemas['WallsView'];
export type RoomsWish = Schemas['RoomsRequest'];
export type Rooms = Schemas['RoomsView'];
export type Stroke = Schemas['Stroke'];
export type FleetView = Schemas['FleetView'];
