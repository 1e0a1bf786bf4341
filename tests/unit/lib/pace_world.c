#include <assert.h>
#include <string.h>
#include "base/random.h"
#include "base/stats.h"
#include "pace_world.h"

#define STEP UINT64_C(100000)
#define PACKET 1448.0
#define AHEAD 65536.0            /* bytes of a sharp frame that the server writes ahead of the link */
#define MOST_IDS 4096
#define MOST_PACKETS 4096

/* Bytes of the model `engine` at 1920x1080, by scale and quality, as psrd codes it. */
static const double qualities[] = { 1, 10, 20, 30, 40, 50, 60, 70, 80, 85, 90, 95 };
static const double engine[PACE_SCALES][12] = {
	{ 35000, 42254, 52710, 60899, 67602, 74302, 81374, 92470, 110671, 125911, 177753, 236833 },
	{ 14000, 16614, 20306, 23232, 25623, 27958, 30499, 34303, 40401, 45495, 63443, 83540 },
	{ 5000, 6129, 7477, 8588, 9473, 10333, 11239, 12649, 14880, 16644, 22772, 29702 },
};

struct packet {
	uint32_t id;
	uint64_t due_ns;             /* arrives */
	double bytes;
	int is_last, is_sharp, is_superseded;
};
struct ring {
	struct packet at[MOST_PACKETS];
	unsigned head, tail;
	double bytes;
};

struct request {
	struct pace_request asked;
	uint64_t sent_ns, due_ns, shown_ns, drawn_ns;
	int is_superseded;
	double bytes, got;
	unsigned camera;
};

struct sim {
	const struct world *world;
	struct pace pace;
	uint64_t now, random;
	uint64_t next_move_ns, moved_ns; /* of the user */
	uint64_t ask_ns;             /* when the pacer is to be asked; 0: something happened */
	unsigned camera, shown_camera;
	int was_moving;
	struct request request[MOST_IDS]; /* by id */
	uint32_t n_ids;
	uint64_t up_ns, down_ns;     /* last arrivals: both ways keep the order */
	/* the server */
	uint32_t n_arrived, newest, busy, last; /* newest: not begun, or 0; busy: with this id, or 0; last: drawn */
	uint64_t busy_ns, last_ns;   /* busy until; drawn at */
	int is_sharp, has_sharp;     /* what it is busy with; `last` has had it, or gave it up */
	int sharp_is_open;           /* it has begun, and not all of it is on the link */
	double to_code;              /* of the frame that it is busy with */
	unsigned n_unacked;
	struct ring link, air, acks; /* before the link; under way; back */
	/* the client */
	struct packet decoding;      /* the last packet of the frame that is being decoded; id 0: none */
	uint64_t decode_ns;          /* until then; the thread that decodes reads nothing */
	struct world_found found;
};

static struct sim sim;

static void push(struct ring *ring, struct packet packet)
{
	assert(ring->tail - ring->head < MOST_PACKETS);
	ring->at[ring->tail++ % MOST_PACKETS] = packet;
	ring->bytes += packet.bytes;
}

static struct packet *front(struct ring *ring)
{
	return ring->head != ring->tail ? &ring->at[ring->head % MOST_PACKETS] : NULL;
}

static void pop(struct ring *ring)
{
	ring->bytes -= front(ring)->bytes;
	ring->head++;
}

static uint64_t arrival(uint64_t *last_ns)
{
	const double way_ms = sim.world->rtt_ms / 2 + random_in(&sim.random, 0, sim.world->jitter_ms + 1e-9);
	const uint64_t at = sim.now + (uint64_t)(way_ms * 1e6);

	*last_ns = at > *last_ns ? at : *last_ns;
	return *last_ns;
}

static double link_rate(void)
{
	const double t = (double)sim.now * 1e-9, rate = sim.world->mbit * 1e6 / 8;

	return t >= sim.world->slow_from_s && t < sim.world->slow_to_s ? rate / 10 : rate;
}

static unsigned scale_index(uint8_t scale)
{
	return scale == 4 ? 2 : scale == 2 ? 1 : 0;
}

double world_bytes(uint8_t scale, double quality)
{
	const double *bytes = engine[scale_index(scale)];
	unsigned i = 1;

	while (qualities[i] < quality)
		i++;
	return bytes[i - 1] + (bytes[i] - bytes[i - 1]) * (quality - qualities[i - 1]) / (qualities[i] - qualities[i - 1]);
}

static double draw_ms(const struct pace_request *asked)
{
	const unsigned scale = asked->settings.scale;

	return sim.world->draw_ms * (asked->settings.smooth ? 1 : WORLD_NO_SMOOTH) / (scale * scale);
}

/* The scene is another one every 40 cameras, two thirds of a second. */
static double scene_cost(unsigned camera)
{
	uint64_t state = camera / 40;

	random_next(&state);
	return random_in(&state, sim.world->cost_low, sim.world->cost_high + 1e-9);
}

/* ---- a step of each ---- */

static int user_moves(void)
{
	const double t = (double)sim.now * 1e-9, turn = sim.world->move_s + sim.world->rest_s;

	return t - turn * (double)(unsigned)(t / turn) < sim.world->move_s;
}

static void step_user(void)
{
	const int is_moving = user_moves();

	sim.found.n_rests += sim.was_moving && !is_moving;
	sim.was_moving = is_moving;
	if (!is_moving || sim.now < sim.next_move_ns)
		return;
	sim.next_move_ns = sim.now + WORLD_SECOND / 60;
	sim.moved_ns = sim.now;
	sim.camera++;
	pace_moved(&sim.pace, sim.now);
	sim.ask_ns = 0;
}

static unsigned count_open(void)
{
	unsigned n = 0;

	for (uint32_t id = sim.n_ids; id > 0 && id + 64 > sim.n_ids; id--)
		n += sim.request[id].shown_ns == 0 && !sim.request[id].is_superseded;
	return n;
}

static void step_requests(void)
{
	struct pace_request asked;

	while (sim.now >= sim.ask_ns && pace_next(&sim.pace, sim.now, &asked, &sim.ask_ns)) {
		struct request *request = &sim.request[++sim.n_ids];

		assert(sim.n_ids < MOST_IDS - 1);
		*request = (struct request){ .asked = asked, .sent_ns = sim.now, .camera = sim.camera };
		request->due_ns = arrival(&sim.up_ns);
		pace_sent(&sim.pace, sim.n_ids, &asked, sim.now);
		sim.ask_ns = 0;
		if (!asked.is_sharp && count_open() > sim.found.most_open)
			sim.found.most_open = count_open();
		sim.found.n_asked += asked.is_sharp;
		sim.found.n_late += asked.is_sharp && sim.now > sim.moved_ns + 100 * WORLD_MS;
	}
	assert(sim.ask_ns > sim.now);
}

static void superseded(uint32_t id)
{
	const uint64_t due_ns = sim.now + (uint64_t)(sim.world->rtt_ms / 2 * 1e6);

	push(&sim.air, (struct packet){ .id = id, .due_ns = due_ns, .is_superseded = 1 });
}

/* What is not on the link yet of a sharp frame goes. */
static void give_up_sharp(void)
{
	struct ring *link = &sim.link;

	sim.has_sharp = 1;
	if (!sim.sharp_is_open)
		return;
	while (link->head != link->tail && link->at[(link->tail - 1) % MOST_PACKETS].is_sharp)
		link->bytes -= link->at[--link->tail % MOST_PACKETS].bytes;
	if (sim.is_sharp)
		sim.busy = 0;
	sim.sharp_is_open = 0;
	sim.n_unacked--;
}

static void begin(uint32_t id, int is_sharp)
{
	struct request *request = &sim.request[id];

	sim.busy = id;
	sim.is_sharp = is_sharp;
	sim.n_unacked++;
	sim.found.most_unacked = sim.n_unacked > sim.found.most_unacked ? sim.n_unacked : sim.found.most_unacked;
	sim.busy_ns = sim.now + (uint64_t)((is_sharp ? sim.world->draw_ms : draw_ms(&request->asked)) * 1e6);
	request->drawn_ns = sim.busy_ns - sim.now;
	request->got = 0;
	request->bytes = is_sharp ? WORLD_SHARP_BYTES
	                          : world_bytes(request->asked.settings.scale, request->asked.color_quality) *
	                                scene_cost(request->camera);
	sim.to_code = request->bytes;
	sim.sharp_is_open |= is_sharp;
}

static void code(void)
{
	double bytes = WORLD_CODE_RATE * 1e-9 * (double)STEP;

	while (bytes > 0 && sim.to_code > 0 && (!sim.is_sharp || sim.link.bytes < AHEAD)) {
		const double part = sim.to_code < PACKET ? sim.to_code : PACKET;

		sim.to_code -= part;
		bytes -= part;
		push(&sim.link, (struct packet){
			.id = sim.busy, .bytes = part, .is_last = sim.to_code <= 0, .is_sharp = sim.is_sharp });
	}
	if (sim.to_code > 0)
		return;
	sim.last = sim.busy;
	sim.last_ns = sim.now;
	sim.has_sharp = sim.is_sharp;
	sim.busy = 0;
}

static void step_server(void)
{
	while (front(&sim.acks) != NULL && front(&sim.acks)->due_ns <= sim.now) {
		sim.n_unacked--;
		pop(&sim.acks);
	}
	while (sim.n_arrived < sim.n_ids && sim.request[sim.n_arrived + 1].due_ns <= sim.now) {
		if (sim.newest != 0)
			superseded(sim.newest);
		sim.newest = ++sim.n_arrived;
		give_up_sharp();
	}
	if (sim.busy == 0 && sim.newest != 0 && sim.n_unacked < PACE_WINDOW) {
		begin(sim.newest, 0);
		sim.newest = 0;
	}
	if (sim.busy == 0 && sim.newest == 0 && sim.last != 0 && !sim.has_sharp && sim.request[sim.last].asked.is_sharp &&
	    sim.now >= sim.last_ns + 100 * WORLD_MS && sim.n_unacked < PACE_WINDOW)
		begin(sim.last, 1);
	if (sim.busy != 0 && sim.now >= sim.busy_ns)
		code();
}

static void step_link(void)
{
	static double room;
	struct packet *packet;

	room = (front(&sim.link) != NULL ? room : 0) + link_rate() * 1e-9 * (double)STEP;
	while ((packet = front(&sim.link)) != NULL && room >= packet->bytes) {
		room -= packet->bytes;
		packet->due_ns = arrival(&sim.down_ns);
		if (packet->is_sharp && packet->is_last)
			sim.sharp_is_open = 0;
		push(&sim.air, *packet);
		pop(&sim.link);
	}
	if (!sim.sharp_is_open && sim.link.bytes / link_rate() * 1e3 > sim.found.most_queue_ms)
		sim.found.most_queue_ms = sim.link.bytes / link_rate() * 1e3;
}

static uint64_t decode_ns(const struct request *request, int is_sharp)
{
	const unsigned scale = is_sharp ? 1 : request->asked.settings.scale;

	return (uint64_t)(sim.world->decode_ms * 1e6) / (scale * scale);
}

static void show(uint32_t id, int is_sharp)
{
	struct request *request = &sim.request[id];

	push(&sim.acks, (struct packet){ .id = id, .due_ns = arrival(&sim.up_ns) });
	sim.found.n_backwards += request->camera < sim.shown_camera;
	sim.shown_camera = request->camera;
	if (is_sharp && request->camera == sim.camera) {
		const double ms = (double)(sim.now - sim.moved_ns) * 1e-6;

		sim.found.n_sharp++;
		sim.found.sharp_ms = ms > sim.found.sharp_ms ? ms : sim.found.sharp_ms;
	}
	if (!is_sharp)
		request->shown_ns = sim.now;
	pace_acknowledged(&sim.pace, id, decode_ns(request, is_sharp), sim.now);
}

/* A frame has come; it is decoded before anything else is read. */
static void complete(const struct packet *packet)
{
	struct request *request = &sim.request[packet->id];
	const struct pace_cost cost = { .bytes = (uint64_t)request->bytes, .server_ns = request->drawn_ns };

	pace_complete(&sim.pace, packet->id, &cost, sim.now);
	sim.decoding = *packet;
	sim.decode_ns = sim.now + decode_ns(request, packet->is_sharp);
}

static void step_client(void)
{
	uint32_t first = 0;
	double bytes = 0;

	if (sim.decoding.id != 0 && sim.now < sim.decode_ns)
		return;
	if (sim.decoding.id != 0)
		show(sim.decoding.id, sim.decoding.is_sharp);
	sim.ask_ns = sim.decoding.id != 0 ? 0 : sim.ask_ns;
	sim.decoding.id = 0;
	while (front(&sim.air) != NULL && front(&sim.air)->due_ns <= sim.now && sim.decoding.id == 0) {
		const struct packet packet = *front(&sim.air);
		struct request *request = &sim.request[packet.id];

		pop(&sim.air);
		sim.ask_ns = 0;
		if (packet.is_superseded) {
			pace_ended(&sim.pace, packet.id);
			request->is_superseded = 1;
			continue;
		}
		first = request->got == 0 ? packet.id : first;
		request->got += packet.bytes;
		bytes = packet.id == first ? bytes + packet.bytes : 0;
		if (packet.is_last && first == packet.id)
			pace_first_bytes(&sim.pace, first, (uint64_t)bytes, sim.now);
		if (packet.is_last)
			complete(&packet);
		first = packet.is_last ? 0 : first;
	}
	if (first != 0)
		pace_first_bytes(&sim.pace, first, (uint64_t)bytes, sim.now);
}

void world_run(const struct world *world, const struct pace_wish *wish, uint64_t seed)
{
	memset(&sim, 0, sizeof sim);
	sim.world = world;
	sim.random = seed;
	pace_init(&sim.pace, wish, 0);
	for (; sim.now < (uint64_t)(world->total_s * 1e9); sim.now += STEP) {
		step_user();
		step_server();
		step_link();
		step_client();
		step_requests();
	}
	sim.found.is_last_shown = sim.shown_camera == sim.camera;
}

const struct world_found *world_found(void)
{
	return &sim.found;
}

/* ---- what came of it ---- */

struct world_figures world_figures(double from_s, double to_s)
{
	static double ms[MOST_IDS];
	struct world_figures f = { 0 };
	size_t n = 0;
	uint8_t scale = 0;
	uint64_t before_ns = 0;

	for (uint32_t id = 1; id <= sim.n_ids; id++) {
		const struct request *r = &sim.request[id];
		const double shown = (double)r->shown_ns * 1e-9;

		if (r->shown_ns == 0 || shown < from_s || shown >= to_s)
			continue;
		ms[n++] = (double)(r->shown_ns - r->sent_ns) * 1e-6;
		if (before_ns != 0 && (double)(r->shown_ns - before_ns) * 1e-6 > f.gap_ms)
			f.gap_ms = (double)(r->shown_ns - before_ns) * 1e-6;
		before_ns = r->shown_ns;
		f.n_changes += n > 1 && scale != r->asked.settings.scale;
		scale = r->asked.settings.scale;
		f.scale += r->asked.settings.scale;
		f.quality += r->asked.color_quality;
		f.bytes += r->bytes;
	}
	if (n == 0)
		return f;
	stats_sort(ms, n);
	f.p50_ms = stats_percentile(ms, n, 0.5);
	f.p99_ms = stats_percentile(ms, n, 0.99);
	f.fps = (double)n / (to_s - from_s);
	f.scale /= (double)n;
	f.quality /= (double)n;
	f.bytes /= (double)n;
	return f;
}

