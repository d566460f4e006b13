// The bridge's page: live numbers and pictures, and what the terminal can do, by pressing and typing.
import '../common/theme.css';
import './shell.css';
import { Link } from './link';
import { Shell } from './shell';
import { takeToken } from '../common/token';
import { CalibrateView } from './views/calibrate';
import { CameraView } from './views/camera';
import { CertificateView } from './views/certificate';
import { DeviceView } from './views/device';
import { DoctorView } from './views/doctor';
import { LiveView } from './views/live';
import { RecordView } from './views/record';

const token = takeToken();
const link = new Link(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws`, token);
const shell = new Shell(link, token);
shell.add(new LiveView(shell));
shell.add(new DeviceView(shell));
shell.add(new RecordView(shell));
shell.add(new CameraView(shell));
shell.add(new CalibrateView(shell));
shell.add(new CertificateView(shell));
shell.add(new DoctorView(shell));
shell.start();
link.connect();
