#include <assert.h>
#include <string.h>
#include "pace.h"

/* The shares of a frame's time that one frame may take on the link, and in server or decoder; the rest is for
 * everything that the models do not foresee. At most two frames are under way, so one may take two frame times from
 * request to ACK, and a little more: nobody gives up half of the picture for six percent of the rate. */
#define LINK_PART 0.8
#define DRAW_PART 0.9
#define CYCLE_PART 1.06

/* The pacer takes a sharper rung only if it fits with this much room, so that noise does not make it jump. */
#define CLIMB_PART 0.8

/* A frame is at most this much larger than earlier ones: the link has not shown that it carries more. */
#define MOST_GROWTH 4.0

#define NOT_SMOOTH_PART 0.75

/* Bytes of JPEG relative to quality 50: the mean of three models at 1920x1080 (docs/decisions). From 90 on the encoder
 * keeps full chroma. */
static const struct { double quality, bytes; } curve[] = {
	{ 1, 0.50 }, { 10, 0.66 }, { 20, 0.77 }, { 30, 0.86 }, { 40, 0.93 }, { 50, 1.00 }, { 60, 1.07 },
	{ 70, 1.19 }, { 80, 1.37 }, { 85, 1.53 }, { 90, 2.23 }, { 95, 2.90 }, { 100, 5.00 },
};

/* From sharp to coarse. */
static const struct { uint8_t scale, index, is_smooth; } ladder[] = {
	{ 1, 0, 1 }, { 1, 0, 0 }, { 2, 1, 1 }, { 2, 1, 0 }, { 4, 2, 1 }, { 4, 2, 0 },
};
#define N_RUNGS (sizeof ladder / sizeof ladder[0])

static unsigned rung_of(const struct psr_msg_settings *settings)
{
	unsigned rung = 0;

	while (ladder[rung].scale != settings->scale || ladder[rung].is_smooth != settings->smooth)
		rung++;
	return rung;
}

static double larger(double a, double b)
{
	return a > b ? a : b;
}

static double smaller(double a, double b)
{
	return a < b ? a : b;
}

static double seconds(uint64_t from_ns, uint64_t to_ns)
{
	return to_ns > from_ns ? (double)(to_ns - from_ns) * 1e-9 : 0;
}

static double curve_at(double quality)
{
	unsigned i = 1;

	while (curve[i].quality < quality)
		i++;
	return curve[i - 1].bytes + (curve[i].bytes - curve[i - 1].bytes) * (quality - curve[i - 1].quality) /
	                                (curve[i].quality - curve[i - 1].quality);
}

/* ---- models of cost ---- */

static double pixels(const struct pace *pace, uint8_t scale)
{
	return (double)((pace->wish.width + scale - 1) / scale) * (double)((pace->wish.height + scale - 1) / scale);
}

static double draw_units(const struct pace *pace, unsigned rung)
{
	return pixels(pace, ladder[rung].scale) * (ladder[rung].is_smooth ? 1 : NOT_SMOOTH_PART);
}

static double byte_units(const struct pace *pace, uint8_t scale, double quality)
{
	return pixels(pace, scale) * curve_at(quality);
}

/* All scales change by the same factor: a new scene that costs more at one scale costs more at the others. */
static void learn(struct pace_model *model, unsigned index, double units, double cost)
{
	const double found = cost / (model->per_unit[index] * units);
	const double factor = model->is_known ? 0.5 + 0.5 * smaller(found, 8) : found;

	for (unsigned i = 0; i < PACE_SCALES; i++)
		model->per_unit[i] *= factor;
	model->is_known = 1;
}

static void average(double *mean, double value)
{
	*mean = *mean > 0 ? *mean + (value - *mean) / 8 : value;
}

static double most_bytes(const struct pace *pace)
{
	const unsigned n = pace->n_samples < PACE_SAMPLES ? pace->n_samples : PACE_SAMPLES;
	double most = 0;

	for (unsigned i = 0; i < n; i++)
		most = larger(most, pace->sample[i].frame);
	return most;
}

/* Divides bytes by time, both summed over frames: slow frames weigh more, so that a loss of rate shows at once; and
 * jitter, which makes one frame look faster and the next slower, cancels. */
double pace_rate(const struct pace *pace)
{
	const unsigned n = pace->n_samples < PACE_SAMPLES ? pace->n_samples : PACE_SAMPLES;
	double bytes = 0, time = 0;

	for (unsigned i = 0; i < n; i++) {
		bytes += pace->sample[i].bytes;
		time += pace->sample[i].seconds;
	}
	return time > 0 ? bytes / time : 0;
}

/* ---- the next frame ---- */

static double draw_time(const struct pace *pace, unsigned rung)
{
	return pace->draw.is_known ? pace->draw.per_unit[ladder[rung].index] * draw_units(pace, rung) : 0;
}

static double decode_time(const struct pace *pace, unsigned rung)
{
	const unsigned index = ladder[rung].index;

	return pace->decode.is_known ? pace->decode.per_unit[index] * pixels(pace, ladder[rung].scale) : 0;
}

static double frame_bytes(const struct pace *pace, unsigned rung, double quality)
{
	return pace->bytes.per_unit[ladder[rung].index] * byte_units(pace, ladder[rung].scale, quality);
}

/* Returns how many bytes a frame of this rung may have; 0 or less: there is no time for any. */
static double byte_budget(const struct pace *pace, unsigned rung)
{
	const double frame = 1 / pace->wish.fps, rate = pace_rate(pace), most = MOST_GROWTH * most_bytes(pace);
	const double cycle = larger(PACE_WINDOW * CYCLE_PART * frame - pace->away, PACE_WORK_FRAMES * frame);
	const double link = smaller(LINK_PART * frame, cycle - draw_time(pace, rung) - decode_time(pace, rung));

	return rate > 0 ? smaller(rate * link, most) : most;
}

static unsigned coarsest(const struct pace *pace)
{
	unsigned rung = N_RUNGS - 1;

	while (ladder[rung].scale > pace->wish.most_scale)
		rung--;
	return rung;
}

static int fits(const struct pace *pace, unsigned rung, double part)
{
	const double most = part * DRAW_PART / pace->wish.fps;

	return draw_time(pace, rung) <= most && decode_time(pace, rung) <= most &&
	       frame_bytes(pace, rung, pace->wish.least_quality) <= part * byte_budget(pace, rung);
}

static unsigned choose_rung(const struct pace *pace)
{
	const unsigned last = coarsest(pace);

	for (unsigned rung = 0; rung < last; rung++)
		if (fits(pace, rung, rung < pace->rung ? CLIMB_PART : 1))
			return rung;
	return last;
}

static uint8_t choose_quality(const struct pace *pace, unsigned rung)
{
	const double budget = byte_budget(pace, rung);
	uint8_t quality = pace->wish.most_quality;

	while (quality > pace->wish.least_quality && frame_bytes(pace, rung, quality) > budget)
		quality--;
	return quality;
}

static void choose(struct pace *pace, struct pace_request *request, int is_sharp)
{
	const int is_new = pace->n_samples == 0;

	pace->rung = is_new ? coarsest(pace) : choose_rung(pace);
	memset(request, 0, sizeof *request);
	request->settings.scale = ladder[pace->rung].scale;
	request->settings.smooth = ladder[pace->rung].is_smooth;
	request->settings.spacing_px = 1;
	request->color_codec = PSR_CODEC_JPEG;
	request->color_quality = is_new ? pace->wish.least_quality : choose_quality(pace, pace->rung);
	request->is_sharp = is_sharp != 0;
	request->pass_limit = is_sharp ? pace->wish.pass_limit : 0;
}

/* Returns the time between two requests of a movement. It is the wished one, unless the slowest part of the way needs
 * longer (then a little more than that, so that its queue drains), or two requests under way do not fill the way; then
 * they are spread over its length. */
static double interval(const struct pace *pace, const struct pace_request *request)
{
	const double rate = pace_rate(pace);
	const double link = rate > 0 ? frame_bytes(pace, pace->rung, request->color_quality) / rate : 0;
	const double slowest = larger(link, larger(draw_time(pace, pace->rung), decode_time(pace, pace->rung)));

	return larger(larger(1 / pace->wish.fps, 1.05 * slowest), 0.9 * pace->latency / PACE_WINDOW);
}

/* ---- events ---- */

void pace_init(struct pace *pace, const struct pace_wish *wish, uint64_t now_ns)
{
	static const double bytes_at_50[PACE_SCALES] = { 0.03, 0.045, 0.07 };

	memset(pace, 0, sizeof *pace);
	for (unsigned i = 0; i < PACE_SCALES; i++) {
		pace->bytes.per_unit[i] = bytes_at_50[i];
		pace->draw.per_unit[i] = pace->decode.per_unit[i] = 1;
	}
	pace_set_wish(pace, wish, now_ns);
	pace_rested(pace);
}

void pace_set_wish(struct pace *pace, const struct pace_wish *wish, uint64_t now_ns)
{
	assert(wish->fps >= 1 && wish->width > 0 && wish->height > 0);
	assert(wish->least_quality >= 1 && wish->least_quality <= wish->most_quality && wish->most_quality <= 100);
	assert(wish->most_scale == 1 || wish->most_scale == 2 || wish->most_scale == 4);
	pace->wish = *wish;
	pace_moved(pace, now_ns);
}

void pace_moved(struct pace *pace, uint64_t now_ns)
{
	pace->is_moving = 1;
	pace->is_drawn = 0;
	pace->wants_sharp = 1;
	pace->moved_ns = now_ns;
}

void pace_rested(struct pace *pace)
{
	pace->is_moving = 0;
}

static struct pace_open *find(struct pace *pace, uint32_t id)
{
	for (unsigned i = 0; i < PACE_OPEN; i++)
		if (pace->open[i].id == id)
			return &pace->open[i];
	return NULL;
}

static unsigned count_open(const struct pace *pace)
{
	unsigned n = 0;

	for (unsigned i = 0; i < PACE_OPEN; i++)
		n += pace->open[i].id != 0;
	return n;
}

int pace_next(struct pace *pace, uint64_t now_ns, struct pace_request *request, uint64_t *again_ns)
{
	const unsigned n_open = count_open(pace);

	if (pace->is_moving && now_ns >= pace->moved_ns + PACE_REST_NS)
		pace->is_moving = 0;
	*again_ns = pace->is_moving ? pace->moved_ns + PACE_REST_NS : PACE_NEVER;
	/* At rest no other request follows, so this one waits for neither window nor interval: the server begins it in its
	 * turn, and gives up requests that it has not begun. */
	if (!pace->is_moving && pace->wants_sharp && n_open < PACE_OPEN) {
		choose(pace, request, 1);
		return 1;
	}
	if (!pace->is_moving || pace->is_drawn || n_open >= PACE_WINDOW)
		return 0;
	if (now_ns < pace->due_ns) {
		*again_ns = pace->due_ns < *again_ns ? pace->due_ns : *again_ns;
		return 0;
	}
	choose(pace, request, 0);
	return 1;
}

void pace_sent(struct pace *pace, uint32_t id, const struct pace_request *request, uint64_t now_ns)
{
	const uint64_t step = (uint64_t)(interval(pace, request) * 1e9);
	struct pace_open *open = find(pace, 0);

	assert(id != 0 && open != NULL);
	*open = (struct pace_open){ .id = id, .sent_ns = now_ns, .request = *request };
	pace->is_drawn = 1;
	if (request->is_sharp)
		pace->wants_sharp = 0;
	/* A request that is late by less than half a step does not move the later ones. */
	pace->due_ns = (pace->due_ns + step / 2 > now_ns ? pace->due_ns : now_ns) + step;
}

void pace_first_bytes(struct pace *pace, uint32_t id, uint64_t bytes, uint64_t now_ns)
{
	struct pace_open *open = find(pace, id);

	if (id == 0 || open == NULL || open->first_ns != 0)
		return;
	open->first_ns = now_ns;
	open->first_bytes = bytes;
}

/* A frame that came in one read took no measurable time: the link is faster than the pacer can tell. */
static void add_sample(struct pace *pace, const struct pace_open *open, uint64_t bytes, uint64_t now_ns)
{
	struct pace_sample *sample = &pace->sample[pace->n_samples++ % PACE_SAMPLES];
	const int is_whole = open->first_ns == 0 || open->first_bytes >= bytes;

	sample->frame = (double)bytes;
	sample->bytes = (double)(is_whole ? bytes : bytes - open->first_bytes);
	sample->seconds = is_whole ? 0 : seconds(open->first_ns, now_ns);
}

void pace_complete(struct pace *pace, uint32_t id, const struct pace_cost *cost, uint64_t now_ns)
{
	struct pace_open *open = find(pace, id);
	unsigned rung;
	double away;

	if (id == 0 || open == NULL || open->is_complete)
		return;
	open->is_complete = 1;
	rung = rung_of(&open->request.settings);
	add_sample(pace, open, cost->bytes, now_ns);
	learn(&pace->bytes, ladder[rung].index, byte_units(pace, ladder[rung].scale, open->request.color_quality),
	      (double)cost->bytes);
	if (cost->server_ns > 0)
		learn(&pace->draw, ladder[rung].index, draw_units(pace, rung), (double)cost->server_ns * 1e-9);
	away = seconds(open->sent_ns + cost->queue_ns + cost->server_ns, open->first_ns != 0 ? open->first_ns : now_ns);
	average(&pace->away, away);
}

void pace_acknowledged(struct pace *pace, uint32_t id, uint64_t decode_ns, uint64_t now_ns)
{
	struct pace_open *open = find(pace, id);
	unsigned rung;

	if (id == 0 || open == NULL)
		return;
	rung = rung_of(&open->request.settings);
	if (decode_ns > 0)
		learn(&pace->decode, ladder[rung].index, pixels(pace, open->request.settings.scale), (double)decode_ns * 1e-9);
	average(&pace->latency, seconds(open->sent_ns, now_ns));
	open->id = 0;
}

void pace_ended(struct pace *pace, uint32_t id)
{
	struct pace_open *open = find(pace, id);

	if (id != 0 && open != NULL)
		open->id = 0;
}
