'use strict';
/* What a study asks of the page besides votes: consent, questions, the check of the screen, what is
   recorded of each configuration, breaks, sending and withdrawing. The script of judge_page.html
   comes after it, and what both use is there. */

/* ---- what is recorded ---- */

/** Beside the votes, of a judge who begins. */
const recordedFor = count => ({
  token: [...crypto.getRandomValues(new Uint8Array(16)) ].map(byte => byte.toString(16).padStart(2, '0')).join(''),
  consent: null,
  panel: {},
  sessions: [],
  calibration: null,
  sent: false,
  practice: { at: 0, attempts: 1, answers: [], passed: null },
  marks: Array(count).fill(null),
});

const newSeeing = () => ({
  looks: 0,
  shown_ms: 0,
  alternations: 0,
  hidden_ms: 0,
  dropped_frames: 0,
  timeouts: 0,
  full_screen: null,
  image_css_px: null,
  image_device_px: null,
  changes: []
});

/** What is recorded of the configuration at a place of the order; of practice nothing is kept. */
const markAt = place => practising() ? newSeeing() : judge.marks[place] ??= newSeeing();

const intervals = [];  // between the last frames, in milliseconds
let frameTime = null;  // the usual one

/** A frame that came so long after the one before. */
function noteFrame(seeing, past) {
  if (past <= 0) return;
  if (frameTime !== null && past > 1.5 * frameTime) seeing.dropped_frames += Math.round(past / frameTime) - 1;
  intervals.push(past);
  if (intervals.length > 61) intervals.shift();
  if (intervals.length > 10) frameTime = [...intervals ].sort((a, b) => a - b)[intervals.length >> 1];
}

let hiddenSince = null;

function noteHidden(hidden) {
  if (hidden)
    hiddenSince = performance.now();
  else if (hiddenSince !== null) {
    markAt(judge.at).hidden_ms += performance.now() - hiddenSince;
    hiddenSince = null;
  }
}

/** An answer, the first one or one that changes it. */
function noteAnswer(choice, time) {
  const seeing = markAt(judge.at);
  const width = document.querySelector('#left canvas').getBoundingClientRect().width;
  seeing.full_screen = document.fullscreenElement !== null;
  seeing.image_css_px = width;
  seeing.image_device_px = Math.round(width * devicePixelRatio);
  if (seeing.changes.length < 1000) seeing.changes.push([ choice, time ]);
}

const isWaitingForConsent = who => study.consent !== null && !who.consent;

/**
 * What the study records of the browser and the screen, once for each time that the page is
 * opened.
 */
function beginSession() {
  if (isWaitingForConsent(judge) || judge.sessions.at(-1)?.tab === tab) return;
  const { record } = study;
  const has = query => matchMedia(query).matches;
  const session = { tab };
  if (record.clock) session.begun = new Date().toISOString();
  if (record.browser) session.browser = navigator.userAgent;
  if (record.language) session.languages = [...navigator.languages ];
  if (record.screen) {
    session.screen = {
      width: screen.width,
      height: screen.height,
      pixel_ratio: devicePixelRatio,
      colour_depth: screen.colorDepth,
      gamut: [ 'rec2020', 'p3', 'srgb' ].find(gamut => has(`(color-gamut: ${gamut})`)) ?? '',
      high_dynamic_range: has('(dynamic-range: high)'),
      window_width: innerWidth,
      window_height: innerHeight
    };
  }
  if (record.time_zone) session.time_zone = Intl.DateTimeFormat().resolvedOptions().timeZone;
  if (record.forced_colors) session.forced_colors = has('(forced-colors: active)');
  if (record.prefers_color_scheme) session.prefers_color_scheme = has('(prefers-color-scheme: dark)') ? 'dark' : 'light';
  if (Object.values(record).some(recorded => recorded)) judge.sessions.push(session);
  if (record.panel) {
    const address = new URLSearchParams(location.search);
    for (const name of ['PROLIFIC_PID', 'STUDY_ID', 'SESSION_ID']) {
      if (address.has(name)) judge.panel[name] = address.get(name).slice(0, 200);
    }
  }
}

/** Everything of the judge at work in one file (docs/file-formats.md). */
function judgeFile() {
  const tenth = value => Math.round(10 * value) / 10;
  const answers = list => Object.fromEntries(list.map(({ name }) => [name, answerTo(name)]));
  return JSON.stringify(
           {
             format: 'merl-scan judge',
             version: 1,
             kit_hash: kit.kit_hash,
             study_hash: kit.study_hash,
             seed: kit.seed,
             judge: judge.name,
             token: judge.token,
             complete: answered() === kit.trials.length,
             consent: judge.consent,
             panel: judge.panel,
             calibration: judge.calibration,
             sessions: judge.sessions.map(({ tab: _, ...session }) => session),
             practice: { attempts: judge.practice.attempts, passed: judge.practice.passed, answers: judge.practice.answers },
             survey: {...answers(questionsBefore), ...answers(questionsAfter) },
             trials: judge.order.map(({ trial, swapped }, place) => {
               const { configuration, kind } = kit.trials[trial];
               const [left, right] = sidesAt(place).map(side => side.map(material => kit.materials[material]));
               const seeing = judge.marks[place] ?? newSeeing();
               return {
                 trial: place + 1,
                 configuration,
                 kind,
                 left,
                 right,
                 swapped: swapped ? 1 : 0,
                 vote: judge.votes[place] || null,
                 response_ms: judge.times[place],
                 ...seeing,
                 shown_ms: tenth(seeing.shown_ms),
                 hidden_ms: tenth(seeing.hidden_ms),
                 changes: seeing.changes.map(([ vote, response_ms ]) => ({ vote, response_ms }))
               };
             }),
           },
           null, 1) +
    '\n';
}

/* ---- the way to the first configuration ---- */

/** The screens before the experiment, in their order. */
function screensBefore() {
  const { calibration } = study;
  return [
    study.consent !== null && 'consent', questionsBefore.length > 0 && 'before',
    (calibration.card || calibration.gamma || calibration.colour_vision) && 'calibrate', 'practice'
  ].filter(name => name);
}

const beforeTrials = [ 'consent', 'before', 'calibrate', 'practice' ];

function turnToNext(screen) {
  const screens = screensBefore();
  turnTo(screens[screens.indexOf(screen) + 1]);
}

const languageOfBrowser = () =>
  navigator.languages.flatMap(tag => study.languages.filter(own => (tag.toLowerCase() + '-').startsWith(own.toLowerCase() + '-')))[0] ??
  study.languages[0];

/** The pixels that the window has and needs, where it has too few. */
function windowTooSmall() {
  const { window_width: width, window_height: height } = study.calibration;
  return innerWidth < width || innerHeight < height ? { have: `${innerWidth} × ${innerHeight}`, need: `${width} × ${height}` } : null;
}

/** Whom the address of the page names: ?judge=, or a panel. */
function nameFromAddress() {
  const address = new URLSearchParams(location.search);
  const name = cleaned((address.get('judge') ?? (study.record.panel ? address.get('PROLIFIC_PID') : null) ?? '').slice(0, 60));
  if (name === '') return;
  byId('name').value = name;
  byId('name').readOnly = true;
  showKnown();
}

function fillConsent() {
  if (study.consent === null) return;
  byId('consentText').textContent = text('consent');
  const { card, gamma, colour_vision: colours } = study.calibration;
  const recorded = [
    'answers', 'viewing', ...card || gamma || colours ? [ 'calibration' ] : [],
    ...Object.keys(study.record).filter(name => study.record[name])
  ];
  byId('records').replaceChildren(...recorded.map(name => {
    const item = document.createElement('li');
    item.textContent = text('records_' + name);
    return item;
  }));
  byId('recordsWhere').textContent = text('stored');
}

/* ---- questions ---- */

/** What the judge at work has answered; a question may have any name, as `constructor`. */
const answerTo = name => Object.hasOwn(judge.survey, name) ? judge.survey[name] : '';

/** What a question says: by language, or a text of the page. */
const said = (words, key) => words ? words[language] : text(key);

function choicesOf(question) {
  if (question.kind === 'choice') {
    return question.choices.map(
      ({ answer, text: words, label }) =>
        [answer,
         words          ? words[language] :
           label === '' ? answer :
                          text(label)]);
  }
  const { least, most, low, high } = question;
  return Array.from({ length: most - least + 1 }, (_, i) => {
    const words = i === 0 ? low : i === most - least ? high : null;
    return [ String(least + i), words ? `${least + i}: ${words[language]}` : String(least + i) ];
  });
}

function makeQuestions(form, questions, button) {
  byId(form).replaceChildren(...questions.map(question => {
    const { name, kind } = question;
    const set = document.createElement('fieldset');
    const legend = document.createElement('legend');
    legend.textContent = said(question.text, name) + (question.required ? ' *' : '');
    set.append(legend);
    if (kind === 'text' || kind === 'number') {
      const field = document.createElement(kind === 'text' ? 'textarea' : 'input');
      field.name = name;
      field.required = question.required ?? false;
      field.setAttribute('aria-label', legend.textContent);
      if (kind === 'text')
        field.maxLength = 10000;
      else
        Object.assign(field, { type: 'number', min: question.least, max: question.most, step: 'any', className: 'number' });
      set.append(field);
      return set;
    }
    const row = document.createElement('div');
    row.className = 'row';
    row.append(...choicesOf(question).map(([ answer, label ]) => {
      const box = document.createElement('label');
      const input = document.createElement('input');
      Object.assign(input, { type: 'radio', name, value: answer, required: question.required ?? false });
      box.append(input, label);
      return box;
    }));
    set.append(row);
    return set;
  }));
  const finish = document.createElement('button');
  finish.className = 'main';
  finish.textContent = text(button);
  finish.style.marginTop = '22px';
  byId(form).append(finish);
}

function fillQuestions(form, questions) {
  for (const { name, kind } of questions) {
    const given = answerTo(name);
    for (const field of byId(form).querySelectorAll(`[name="${name}"]`)) {
      if (kind === 'text' || kind === 'number')
        field.value = given;
      else
        field.checked = field.value === given;
    }
  }
}

/* ---- the screen that is looked at ---- */

const cardLong = 85.6;  // millimetres: ISO/IEC 7810, ID-1
const cardShort = 53.98;
const sphereShare = 0.9;  // of an image's height
const matches = 2;        // of a grey with stripes
let matched = [];         // greys, of this check

function showCalibration() {
  const { card, gamma, colour_vision: colours } = study.calibration;
  byId('cardPart').hidden = !card;
  byId('gammaPart').hidden = !gamma;
  byId('colourPart').hidden = !colours;
  for (const [part, asked] of [[ 'cardPart', card ], [ 'gammaPart', gamma ], [ 'colourPart', colours ]]) {
    for (const field of byId(part).querySelectorAll('input')) field.disabled = !asked;
  }
  matched = [];
  byId('cardTick').checked = false;
  drawCard();
  newMatch();
}

function drawCard() {
  const long = Number(byId('cardSize').value);
  const short = long * cardShort / cardLong;
  const upright = innerWidth < 640;  // a card is wider than a phone
  Object.assign(byId('card').style, { width: `${upright ? short : long}px`, height: `${upright ? long : short}px` });
}

function newMatch() {
  byId('grey').value = 80 + Math.floor(Math.random() * 160);
  byId('gammaTick').checked = false;
  drawStripes();
}

/**
 * Stripes of black and white, as bright as half of white is, around a grey. Two pixels of the
 * device each: what is blurred over one would not be.
 */
function drawStripes() {
  const canvas = byId('stripes');
  const pixels = css => Math.round(css * devicePixelRatio);
  canvas.width = pixels(Math.min(280, innerWidth - 40));
  canvas.height = pixels(140);
  canvas.style.width = `${canvas.width / devicePixelRatio}px`;
  canvas.style.height = `${canvas.height / devicePixelRatio}px`;
  const drawing = canvas.getContext('2d');
  for (let y = 0; y < canvas.height; y++) {
    drawing.fillStyle = (y >> 1) % 2 === 0 ? '#000' : '#fff';
    drawing.fillRect(0, y, canvas.width, 1);
  }
  const grey = byId('grey').value;
  drawing.fillStyle = `rgb(${grey}, ${grey}, ${grey})`;
  drawing.fillRect(
    Math.round(canvas.width / 4), Math.round(canvas.height / 4), Math.round(canvas.width / 2), Math.round(canvas.height / 2));
}

/** The gamma at which a grey, 0 to 255, is half as bright as white. */
const gammaOf = grey => Math.log(0.5) / Math.log(grey / 255);

function finishCalibration() {
  const { card, gamma, colour_vision: colours, gamma_least: least, gamma_most: most } = study.calibration;
  if (gamma) {
    matched.push(Number(byId('grey').value));
    if (matched.length < matches) {
      byId('cardPart').hidden = byId('colourPart').hidden = true;
      newMatch();
      announce(text('gammaText'));
      scrollTo(0, 0);
      return;
    }
  }
  const found = { pixel_ratio: devicePixelRatio, passed: null };
  if (card)
    Object.assign(found, { css_px_per_mm: Number(byId('cardSize').value) / cardLong, distance_mm: 10 * Number(byId('distance').value) });
  if (gamma) {
    found.gammas = matched.map(gammaOf);
    found.gamma = found.gammas.reduce((sum, each) => sum + each, 0) / matches;
    found.passed = found.gamma >= least && found.gamma <= most;
  }
  if (colours) {
    found.colour_vision = byId('calibration').elements.colour.value;
    found.colour_vision_test = byId('colourTest').value;
  }
  judge.calibration = found;
  turnToNext('calibrate');
}

/** The CSS pixels across an image where the study fixes the size of spheres. */
function imageSide() {
  const { unit, diameter } = study.spheres;
  if (unit === 'window') return null;
  if (unit === 'pixels') return diameter / sphereShare;
  const { css_px_per_mm: then, distance_mm: distance, pixel_ratio: ratio = devicePixelRatio } = judge.calibration;
  const density = then * ratio / devicePixelRatio;  // the page may be magnified in another way by now
  return 2 * distance * Math.tan(diameter * Math.PI / 360) * density / sphereShare;
}

/* ---- practice, time and breaks ---- */

/** In a practice configuration one side does not change, or has the original itself. */
const rightAnswer = ({ left }) => left[0] === left[1] ? 1 : 3;

function practise(choice) {
  const { practice } = judge;
  practiceVote = choice;
  judge.practised = choice;
  practice.answers.push({ attempt: practice.attempts, vote: choice || null, right: choice === rightAnswer(kit.practice[practice.at]) });
  if (++practice.at < kit.practice.length) {
    keepJudge();
    showTrial();
    return;
  }
  practice.at = 0;
  const { pass, attempts } = study.practice;
  practice.passed = rightNow() >= pass;
  turnTo(!practice.passed && attempts > 0 && practice.attempts >= attempts ? 'refused' : 'ready');
}

/** How many practice answers of the last attempt were right. */
const rightNow = () => judge.practice.answers.filter(({ attempt, right }) => right && attempt === judge.practice.attempts).length;

function showReady() {
  const { practice } = judge;
  const one = kit.practice.length === 1;
  byId('readyText').hidden = !one;
  byId('readyText').textContent =
    practiceVote === 0 ? text('tooLateHere') : text('readyText', { vote: practiceVote, statement: text('statement' + practiceVote) });
  const words = one ? text(practiceVote === 1 ? 'practisedWell' : 'practisedBadly') :
                      text('practisedCount', { right: rightNow(), of: kit.practice.length });
  byId('practised').textContent =
    practice.passed === false ? `${words} ${text('practisedNotEnough', { pass: study.practice.pass })}` : words;
  byId('begin').hidden = byId('counts').hidden = practice.passed === false;
  byId(practice.passed === false ? 'again' : 'begin').focus();
}

/** Nobody has answered in time. The configuration comes again when the others are answered. */
function runOut() {
  stopTurning();
  if (practising()) {
    practise(0);
    return;
  }
  const lost = judge.votes[judge.at] === 0;
  if (lost) markAt(judge.at).timeouts++;
  const count = kit.trials.length;
  const open = judge.votes.map((vote, place) => vote === 0 ? place : -1).filter(place => place >= 0 && place !== judge.at);
  judge.at = open.find(place => place > judge.at) ?? open[0] ?? (lost ? judge.at : Math.min(judge.at + 1, count - 1));
  keepJudge('votes');
  showTrial();
  if (lost) byId('hint').textContent = text('tooLate');
}

/** Grey checks by lot, as large as a sphere's image. */
function drawMask(canvas, like) {
  canvas.width = like.width;
  canvas.height = like.height;
  canvas.style.width = like.style.width;
  canvas.style.height = like.style.height;
  const draw = lots(`${judge.name}\n${judge.at}`);
  const drawing = canvas.getContext('2d');
  const side = Math.max(1, Math.ceil(canvas.width / 24));
  for (let y = 0; y < canvas.height; y += side) {
    for (let x = 0; x < canvas.width; x += side) {
      const grey = Math.floor(draw() * 256);
      drawing.fillStyle = `rgb(${grey}, ${grey}, ${grey})`;
      drawing.fillRect(x, y, side, side);
    }
  }
}

function showPause() {
  byId('pauseText').textContent = text('pauseText', { done: answered() });
  byId('resume').disabled = study.timing.break_seconds > 0;
  setTimeout(() => {
    byId('resume').disabled = false;
    if (!byId('pause').hidden) byId('resume').focus();
  }, 1000 * study.timing.break_seconds);
  if (!byId('resume').disabled) byId('resume').focus();
}

/* ---- the end ---- */

function showSaved(id) {
  const button = byId(id);
  button.textContent = `✓ ${text(button.dataset.text)} (${text('saved')})`;
  announce(button.textContent);
}

function showDone() {
  byId('doneText').textContent = text(kit.post ? 'doneSent' : 'doneText', { name: judge.name, done: answered() });
  for (const id of ['saveAll', 'saveVotes', 'saveSurvey']) byId(id).textContent = text(byId(id).dataset.text);
  byId('saveSurvey').hidden = questionsBefore.length + questionsAfter.length === 0;
  byId('toSurvey').hidden = questionsAfter.length === 0;
  byId('debriefing').hidden = study.debrief === null;
  byId('debrief').textContent = text('debrief');
  if (kit.post) deliver();
}

const receiver = () => /^https?:\/\/[^/]+/i.exec(kit.post)?.[0].toLowerCase() ?? '';

/**
 * Sends a text to the receiver, which says how many bytes it has stored. Throws an error that is
 * `final` where it does not want it.
 */
async function send(body) {
  const bytes = new TextEncoder().encode(body);
  // A plain text is sent without asking first, also by a page that was opened as a file.
  const response = await fetch(kit.post, {
    method: 'POST',
    body: bytes,
    headers: { 'Content-Type' : 'text/plain;charset=UTF-8' },
    credentials: 'omit',
    cache: 'no-store',
    redirect: 'error',
    referrerPolicy: 'no-referrer',
    signal: AbortSignal.timeout(30000)
  });
  const answer = await response.json().catch(() => ({}));
  if (response.status >= 400 && response.status < 500 && ![408, 425, 429].includes(response.status)) {
    throw Object.assign(new Error(String(answer.error ?? response.status)), { final: true });
  }
  if (!response.ok || answer.stored !== bytes.length) throw new Error(String(answer.error ?? response.status));
}

/** Waits for so many milliseconds, or until the network is back. */
const pauseFor = time => new Promise(done => {
  setTimeout(done, time);
  addEventListener('online', done, { once: true });
});

/** Tries until it is sent, or refused; says before each wait why. */
async function sendUntilStored(body, failed, goesOn = () => true) {
  for (let wait = 1000; goesOn(); wait = Math.min(2 * wait, 60000)) {
    try {
      await send(body());
      return true;
    } catch (error) {
      failed(error);
      if (error.final) return false;
    }
    await pauseFor(wait);
  }
  return false;
}

function showSent(key, values = {}) {
  const place = byId('sent');
  place.hidden = false;
  place.textContent = text(key, values);
  place.classList.toggle('bad', key === 'sendingFailed' || key === 'sendRefused');
}

/** Sends the file of the judge who is done. */
async function deliver() {
  const mine = desk;
  const body = judgeFile();
  if (mine.delivered === body) {
    showSent('sent');
    return;
  }
  if (mine.delivering === body) return;
  mine.delivering = body;
  showSent('sending');
  const current = () => desk === mine && !mine.erased && mine.delivering === body;
  // It may arrive although nobody hears of it.
  mine.judge.sent = true;
  await keepJudge();
  const stored = await sendUntilStored(() => body, error => {
    if (current()) showSent(error.final ? 'sendRefused' : 'sendingFailed', { reason: error.message });
  }, current);
  if (mine.delivering === body) mine.delivering = null;
  if (!stored || mine.erased) return;
  mine.delivered = body;
  if (desk === mine && judgeFile() === body) {
    mine.loose.clear();
    showSent('sent');
  }
}

/* ---- withdrawing ---- */

function askToWithdraw() {
  stopTurning();
  byId('withdrawText').textContent = text('withdrawText', { name: judge.name });
  byId('notErased').hidden = true;
  show('withdrawing');
}

/** Between the pages of this browser. */
let withdrawals = null;

/**
 * A judge has withdrawn in another page; what this one remembers would come back with the next
 * answer.
 */
function forget({ who, token }) {
  const other = desks.get(who);
  if (other && other.judge.token !== token) return;
  if (other) other.erased = true;
  desks.delete(who);
  const name = judgeOfTab();
  if (name && identity(name) === who) welcome();
}

/** Erases the judge at work here, and asks the receiver to, if something was sent. */
async function withdraw() {
  const mine = desk;
  const { name, token, sent } = mine.judge;
  const body = JSON.stringify({ format: 'merl-scan withdrawal', version: 1, kit_hash: kit.kit_hash, token });
  mine.erased = true;
  withdrawals?.postMessage({ who: identity(name), token });
  try {
    // What is still to be asked of the receiver survives a closed page; it says nothing of the
    // judge.
    if (sent) await exchange('withdrawal:' + token, () => body);
    await exchange(keyOf(name), found => found === undefined ? undefined : null);
  } catch {
    mine.erased = false;
    byId('notErased').hidden = false;
    // The receiver can erase all the same.
    if (sent) askToErase(body, token);
    return;
  }
  desks.delete(identity(name));
  leave();
  desk = judge = null;
  keepJudgeOfTab(null);
  byId('name').value = '';
  for (const id of ['beforeQuestions', 'questions', 'calibration']) byId(id).reset();
  byId('withdrawnText').textContent = text('withdrawnText', { sent: sent ? text('withdrawnAsking') : '' });
  show('withdrawn');
  if (sent) await askToErase(body, token);
}

async function askToErase(body, token) {
  const say = key => byId('withdrawnText').textContent = text('withdrawnText', { sent: text(key, { token }) });
  const stored = await sendUntilStored(() => body, () => say('withdrawnFailed'));
  if (!stored) return;
  say('withdrawnAsked');
  await exchange('withdrawal:' + token, found => found === undefined ? undefined : null).catch(() => {});
}

/** Withdrawals that the receiver has not confirmed, from before this page was opened. */
async function askAgain() {
  const opened = await (database ??= openDatabase());
  const keys = await new Promise((done, failed) => {
    const request = opened.transaction('kept').objectStore('kept').getAllKeys(IDBKeyRange.bound('withdrawal:', 'withdrawal;'));
    request.onsuccess = () => done(request.result);
    request.onerror = () => failed(request.error);
  });
  for (const key of keys) {
    const body = await exchange(key, () => undefined);
    if (body) await askToErase(body, key.slice('withdrawal:'.length));
  }
}

/* ---- what people do ---- */

function connectStudy() {
  byId('agreeing').addEventListener('submit', event => {
    event.preventDefault();
    judge.consent = { language, ...study.record.clock ? { given: new Date().toISOString() } : {} };
    byId('tick').checked = false;
    history.replaceState({ judge: judge.name }, '');
    beginSession();
    turnToNext('consent');
  });
  byId('decline').addEventListener('click', () => {
    desks.delete(identity(judge.name));
    byId('tick').checked = false;
    welcome();
  });
  byId('beforeQuestions').addEventListener('submit', event => {
    event.preventDefault();
    turnToNext('before');
  });
  byId('cardSize').value = 324;
  byId('cardSize').addEventListener('input', drawCard);
  byId('grey').addEventListener('input', drawStripes);
  // Stripes are of the device's pixels, which a zoom changes; a card stands upright on a phone.
  addEventListener('resize', () => {
    if (byId('calibrate').hidden) return;
    drawCard();
    drawStripes();
  });
  byId('calibration').addEventListener('submit', event => {
    event.preventDefault();
    finishCalibration();
  });
  byId('resume').addEventListener('click', () => turnTo('trial'));
  byId('withdrawInTrial').addEventListener('click', askToWithdraw);
  byId('withdrawButton').addEventListener('click', askToWithdraw);
  byId('withdrawNo').addEventListener('click', () => show(judge.screen));
  byId('withdrawYes').addEventListener('click', withdraw);
  if (study.consent && typeof BroadcastChannel === 'function') {
    withdrawals = new BroadcastChannel(prefix);
    withdrawals.addEventListener('message', ({ data }) => forget(data));
  }
  if (kit.post) askAgain().catch(() => {});
}
