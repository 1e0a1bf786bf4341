/* Threads that decode rectangles while the caller reads the next ones. */
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include "internal.h"

#define MOST_JOBS 64 /* a frame of 1080p has 18 rectangles */

struct job {
	enum { FREE, WAITS, RUNS } state;
	struct psr_frame picture; /* its planes are the assembly's */
	struct psr_msg_frame asked;
	struct psr_msg_rect rect;
	uint8_t *data;
	size_t capacity;
};

struct client_crew {
	pthread_mutex_t lock;
	pthread_cond_t has_work, has_ended;
	struct job job[MOST_JOBS];
	unsigned next;               /* job to begin with when one that waits is looked for: the oldest */
	unsigned n_open;             /* jobs that wait or run */
	int is_over;
	struct psr_error error;      /* of the first that failed: the connection is of no use any more */
	pthread_t thread[PSR_CLIENT_MAX_THREADS];
	struct client_decoder *decoder[PSR_CLIENT_MAX_THREADS]; /* of each thread */
	struct client_decoder *own;  /* the caller's */
	int n_threads;
};

/* With the lock held, which it gives up meanwhile. Returns 0: nothing waits. */
static int work(struct client_crew *crew, struct client_decoder *decoder)
{
	struct job *job = NULL;
	struct psr_error err;
	int code;

	for (unsigned i = 0; i < MOST_JOBS && job == NULL; i++)
		if (crew->job[(crew->next + i) % MOST_JOBS].state == WAITS)
			job = &crew->job[(crew->next + i) % MOST_JOBS];
	if (job == NULL)
		return 0;
	job->state = RUNS;
	pthread_mutex_unlock(&crew->lock);
	code = client_decode(decoder, &job->picture, &job->asked, &job->rect, job->data, &err);
	pthread_mutex_lock(&crew->lock);
	job->state = FREE;
	crew->n_open--;
	if (code != PSR_OK && crew->error.code == PSR_OK)
		crew->error = err;
	pthread_cond_signal(&crew->has_ended);
	return 1;
}

struct member {
	struct client_crew *crew;
	struct client_decoder *decoder;
};

static void *member_run(void *userdata)
{
	const struct member member = *(struct member *)userdata;
	struct client_crew *crew = member.crew;

	free(userdata);
	pthread_mutex_lock(&crew->lock);
	while (!crew->is_over)
		if (!work(crew, member.decoder))
			pthread_cond_wait(&crew->has_work, &crew->lock);
	pthread_mutex_unlock(&crew->lock);
	return NULL;
}

/* Signals are for the program's own threads. */
static int start_thread(struct client_crew *crew)
{
	struct member *member = malloc(sizeof *member);
	struct client_decoder **decoder = &crew->decoder[crew->n_threads];
	sigset_t all, before;
	int failed;

	if (member == NULL || client_decoder_create(decoder) != PSR_OK) {
		free(member);
		return PSR_ERR_MEMORY;
	}
	*member = (struct member){ crew, *decoder };
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	failed = pthread_create(&crew->thread[crew->n_threads], NULL, member_run, member);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	if (failed) {
		free(member);
		client_decoder_destroy(*decoder);
		return PSR_ERR_MEMORY;
	}
	crew->n_threads++;
	return PSR_OK;
}

int client_crew_create(struct client_crew **out, int n_threads)
{
	struct client_crew *crew = calloc(1, sizeof *crew);
	int code;

	if (crew == NULL)
		return PSR_ERR_MEMORY;
	pthread_mutex_init(&crew->lock, NULL);
	pthread_cond_init(&crew->has_work, NULL);
	pthread_cond_init(&crew->has_ended, NULL);
	code = client_decoder_create(&crew->own);
	for (int i = 0; code == PSR_OK && i < n_threads && i < PSR_CLIENT_MAX_THREADS; i++)
		code = start_thread(crew);
	if (code != PSR_OK) {
		client_crew_destroy(crew);
		return code;
	}
	*out = crew;
	return PSR_OK;
}

void client_crew_destroy(struct client_crew *crew)
{
	if (crew == NULL)
		return;
	pthread_mutex_lock(&crew->lock);
	crew->is_over = 1;
	pthread_cond_broadcast(&crew->has_work);
	pthread_mutex_unlock(&crew->lock);
	for (int i = 0; i < crew->n_threads; i++) {
		pthread_join(crew->thread[i], NULL);
		client_decoder_destroy(crew->decoder[i]);
	}
	client_decoder_destroy(crew->own);
	for (unsigned i = 0; i < MOST_JOBS; i++)
		free(crew->job[i].data);
	pthread_cond_destroy(&crew->has_ended);
	pthread_cond_destroy(&crew->has_work);
	pthread_mutex_destroy(&crew->lock);
	free(crew);
}

static int overlaps(const struct job *job, const struct psr_frame *picture, const struct psr_msg_rect *rect)
{
	const struct psr_msg_rect *a = &job->rect;

	return job->state != FREE && a->plane == rect->plane
	       && psr_frame_plane(&job->picture, a->plane) == psr_frame_plane(picture, a->plane)
	       && a->x < rect->x + rect->w && rect->x < a->x + a->w && a->y < rect->y + rect->h && rect->y < a->y + a->h;
}

/* A later rectangle lies on top of earlier ones, so it waits for those that it touches. */
static int must_wait(const struct client_crew *crew, const struct psr_frame *picture, const struct psr_msg_rect *rect)
{
	if (crew->job[crew->next].state != FREE)
		return 1;
	for (unsigned i = 0; i < MOST_JOBS; i++)
		if (overlaps(&crew->job[i], picture, rect))
			return 1;
	return 0;
}

static int fill_job(struct job *job, const struct psr_msg_rect *rect, const uint8_t *data)
{
	if (job->capacity < rect->total) {
		free(job->data);
		job->data = malloc(rect->total);
		job->capacity = job->data != NULL ? rect->total : 0;
	}
	if (job->data == NULL)
		return PSR_ERR_MEMORY;
	memcpy(job->data, data, rect->total);
	job->rect = *rect;
	job->rect.data = NULL;
	return PSR_OK;
}

int client_crew_decode(struct client_crew *crew, const struct client_assembly *assembly,
                       const struct psr_msg_rect *rect, const uint8_t *data, struct psr_error *err)
{
	struct job *job;
	int code;

	pthread_mutex_lock(&crew->lock);
	while (must_wait(crew, &assembly->picture, rect))
		if (!work(crew, crew->own))
			pthread_cond_wait(&crew->has_ended, &crew->lock);
	job = &crew->job[crew->next];
	code = fill_job(job, rect, data);
	if (code == PSR_OK) {
		job->picture = assembly->picture;
		job->asked = assembly->asked;
		job->state = WAITS;
		crew->n_open++;
		crew->next = (crew->next + 1) % MOST_JOBS;
		pthread_cond_signal(&crew->has_work);
	}
	pthread_mutex_unlock(&crew->lock);
	return code == PSR_OK ? PSR_OK : psr_fail(err, code, "no memory for a rectangle of %u bytes", rect->total);
}

int client_crew_wait(struct client_crew *crew, struct psr_error *err)
{
	int code = PSR_OK;

	pthread_mutex_lock(&crew->lock);
	while (crew->n_open > 0)
		if (!work(crew, crew->own))
			pthread_cond_wait(&crew->has_ended, &crew->lock);
	if (err != NULL && crew->error.code != PSR_OK)
		code = psr_fail(err, crew->error.code, "%s", crew->error.text);
	pthread_mutex_unlock(&crew->lock);
	return code;
}
