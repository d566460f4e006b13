// Samples -> the columns that `--output csv` writes.
import { type Sample, carriesNumbers } from './sample';

export const CSV_HEADER =
  'seq,t_ns,status,' +
  'dx_m,dy_m,dz_m,rx_rad,ry_rad,rz_rad,' +
  'sigma_dx_m,sigma_dy_m,sigma_dz_m,sigma_rx_rad,sigma_ry_rad,sigma_rz_rad,' +
  'fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,' +
  'sigma_fx_n,sigma_fy_n,sigma_fz_n,sigma_mx_nm,sigma_my_nm,sigma_mz_nm,' +
  'dropped,latency_us';

const NO_NUMBERS: readonly number[] = Array<number>(24).fill(0);

export function csvRow(sample: Sample): string {
  const numbers = carriesNumbers(sample.status)
    ? [sample.d_m, sample.d_rad, sample.d_sigma, sample.f_n, sample.m_nm, sample.w_sigma].flat()
    : NO_NUMBERS;
  return [
    sample.seq,
    sample.t_ns,
    sample.status,
    ...numbers,
    sample.dropped,
    Math.round(sample.latency_us),
  ].join(',');
}

export function csvText(samples: Iterable<Sample>): string {
  const rows = [CSV_HEADER];
  for (const sample of samples) rows.push(csvRow(sample));
  return `${rows.join('\n')}\n`;
}
