#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "answers.h"
#include "model/file.h"
#include "server/models/cache.h"

#define READ_BYTES 65536
#define PART_BYTES 16384 /* of a message: so much is lost at most where a connection breaks */

/* Parts on their way from the disk. */
struct fetch_read {
	struct fetch_read *next, **at; /* in the list of all */
	struct session *session;       /* NULL: nobody waits for it any more */
	struct loop *loop;
	struct loop_note note;
	char *path;
	uint32_t id;
	uint64_t offset, end, hash;    /* as in struct fetch; hash becomes the file's */
	/* Belong to the job while it runs: */
	uint64_t file_bytes;
	struct outq_chunk *chunk;      /* FETCH_PARTs; NULL behind the end */
	uint32_t n;                    /* bytes of the file in them */
	struct psr_error error;
	int code;
};

static struct fetch *first_of(struct fetches *fetches)
{
	return &fetches->fetch[fetches->first];
}

/* ---- on the io pool ---- */

/* Reads up to n bytes; returns how many there were, or -1. */
static ssize_t read_at(int fd, void *to, size_t n, uint64_t at)
{
	size_t done = 0;

	while (done < n) {
		const ssize_t got = pread(fd, (char *)to + done, n - done, (off_t)(at + done));

		if (got < 0 && errno == EINTR)
			continue;
		if (got < 0)
			return -1;
		if (got == 0)
			break;
		done += (size_t)got;
	}
	return (ssize_t)done;
}

static int read_header(struct fetch_read *read, int fd)
{
	uint8_t header[FILE_HEADER_BYTES];
	struct stat status;
	uint64_t hash;

	if (fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)
	    || read_at(fd, header, sizeof header, 0) != FILE_HEADER_BYTES)
		return psr_fail(&read->error, PSR_ERR_IO, "the model's file cannot be read");
	hash = file_get(header + HEADER_HASH, 8);
	if (read->hash != 0 && read->hash != hash)
		return psr_fail(&read->error, PSR_ERR_NOT_FOUND, "the model's file is another one by now");
	read->hash = hash;
	read->file_bytes = (uint64_t)status.st_size;
	return PSR_OK;
}

/* Puts bytes of the file into messages. */
static int encode_parts(struct fetch_read *read, const uint8_t *bytes)
{
	struct psr_buf buf = { .data = read->chunk->data, .capacity = read->chunk->capacity };
	int code = PSR_OK;

	for (uint32_t at = 0; at < read->n && code == PSR_OK; at += PART_BYTES) {
		const struct psr_msg_fetch_part msg = { .offset = read->offset + at, .data = bytes + at,
			                                    .bytes = read->n - at < PART_BYTES ? read->n - at : PART_BYTES };

		code = psr_msg_fetch_part_encode(&buf, read->id, &msg, &read->error);
	}
	read->chunk->size = buf.size;
	return code;
}

static int read_parts(struct fetch_read *read, int fd)
{
	const uint64_t end = read->end < read->file_bytes ? read->end : read->file_bytes;
	const uint64_t left = end > read->offset ? end - read->offset : 0;
	const uint32_t n = left < READ_BYTES ? (uint32_t)left : READ_BYTES;
	uint8_t *bytes;
	int code;

	if (n == 0)
		return PSR_OK;
	bytes = malloc(n);
	read->chunk = outq_chunk_create(n + READ_BYTES / PART_BYTES * (PSR_HEADER_SIZE + 16));
	read->n = n;
	if (bytes == NULL || read->chunk == NULL)
		code = psr_fail(&read->error, PSR_ERR_MEMORY, "no memory for a part of a file");
	else if (read_at(fd, bytes, n, read->offset) != (ssize_t)n)
		code = psr_fail(&read->error, PSR_ERR_IO, "the model's file cannot be read from byte %" PRIu64 " on", read->offset);
	else
		code = encode_parts(read, bytes);
	free(bytes);
	return code;
}

static void read_job(void *userdata)
{
	struct fetch_read *read = userdata;
	const int fd = open(read->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

	if (fd < 0)
		read->code = psr_fail(&read->error, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO,
		                      "the model's file cannot be read: %s", strerror(errno));
	else
		read->code = read_header(read, fd);
	if (read->code == PSR_OK)
		read->code = read_parts(read, fd);
	if (fd >= 0)
		close(fd);
	loop_post(read->loop, &read->note);
}

/* ---- on the loop ---- */

static void destroy(struct fetch_read *read)
{
	*read->at = read->next;
	if (read->next != NULL)
		read->next->at = read->at;
	outq_chunks_destroy(read->chunk);
	free(read->path);
	free(read);
}

/* The request under way has ended. */
static void take_off(struct session *session)
{
	struct fetches *fetches = &session->fetches;

	if (first_of(fetches)->model != NULL)
		catalogue_unref(session->all->catalogue, first_of(fetches)->model);
	free(first_of(fetches)->path);
	fetches->first = (fetches->first + 1) % FETCHES_MAX;
	fetches->n--;
	session->n_open--;
	session->all->n_fetches--;
}

static void refuse_first(struct session *session, int code, const char *text)
{
	const uint32_t id = first_of(&session->fetches)->id;

	take_off(session);
	conn_send_error(session->conn, id, 0, code, text);
}

static void on_read(void *userdata);

/* Returns 0 without memory. */
static int start_read(struct session *session, const char *path)
{
	struct sessions *all = session->all;
	const struct fetch *fetch = first_of(&session->fetches);
	struct fetch_read *read = calloc(1, sizeof *read);

	if (read == NULL)
		return 0;
	*read = (struct fetch_read){ .next = all->reads, .at = &all->reads, .session = session, .loop = all->conns->loop,
		                         .path = strdup(path), .id = fetch->id, .offset = fetch->offset, .end = fetch->end,
		                         .hash = fetch->hash };
	read->note = (struct loop_note){ .fn = on_read, .userdata = read };
	if (read->next != NULL)
		read->next->at = &read->next;
	all->reads = read;
	if (read->path == NULL ||
	    psr_pool_submit(all->io, &(struct pool_job){ .fn = read_job, .userdata = read }) != PSR_OK) {
		destroy(read);
		return 0;
	}
	session->fetches.read = read;
	return 1;
}

/* Begins with the next part, if it is time. */
static void go_on(struct session *session)
{
	struct fetches *fetches = &session->fetches;

	while (fetches->n > 0 && fetches->read == NULL && session->conn->state == CONN_OPEN &&
	       session->conn->out.answers.size <= FETCHES_ROOM) {
		const struct fetch *fetch = first_of(fetches);
		char *path = fetch->model == NULL ? strdup(fetch->path)
		                                  : cache_model_path(session->all->options->cache, fetch->model);

		if (path == NULL)
			refuse_first(session, PSR_ERR_NOT_FOUND, "the model's file has changed or gone since it was opened; open it again");
		else if (!start_read(session, path))
			refuse_first(session, PSR_ERR_MEMORY, "no memory for a part of a file");
		free(path);
	}
}

static void end_first(struct session *session, const struct fetch_read *read)
{
	const struct psr_msg_fetch_end msg = { .file_bytes = read->file_bytes, .file_hash = read->hash };
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	take_off(session);
	if (psr_msg_fetch_end_encode(&buf, read->id, &msg, NULL) == PSR_OK)
		conn_send_last(session->conn, read->id, &buf);
}

static void on_read(void *userdata)
{
	struct fetch_read *read = userdata;
	struct session *session = read->session;

	if (session == NULL) {
		destroy(read);
		return;
	}
	session->fetches.read = NULL;
	if (session->conn->state != CONN_OPEN) { /* its last message is queued: none may follow */
		destroy(read);
		return;
	}
	if (read->code != PSR_OK) {
		refuse_first(session, read->code, read->error.text);
	} else if (read->chunk == NULL) {
		end_first(session, read);
	} else {
		struct fetch *fetch = first_of(&session->fetches);

		fetch->hash = read->hash;
		fetch->offset += read->n;
		conn_push(session->conn, read->id, read->chunk);
		read->chunk = NULL;
		if (fetch->offset >= fetch->end || fetch->offset >= read->file_bytes)
			end_first(session, read);
	}
	destroy(read);
	conn_flush(session->conn);
	go_on(session);
}

/* Finds the model, or the path of a file that need not be open. */
static int find_file(struct fetch *fetch, struct session *session, const struct psr_msg_fetch *msg, struct psr_error *err)
{
	const struct catalogue_entry *entry;

	if (msg->handle != 0) {
		fetch->model = handles_find(&session->handles, msg->handle);
		if (fetch->model == NULL)
			return psr_fail(err, PSR_ERR_NOT_FOUND, "no open model has handle %" PRIu32, msg->handle);
		catalogue_ref(session->all->catalogue, fetch->model);
		return PSR_OK;
	}
	entry = catalogue_find(session->all->catalogue, msg->name);
	if (entry == NULL)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "there is no model %.255s; psr list shows all", msg->name);
	if (entry->file.reason != NULL)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s", entry->file.reason);
	if (entry->file.is_source)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "model %.255s is built of its source: OPEN it first, and FETCH its "
		                "handle", msg->name);
	fetch->path = strdup(entry->file.path);
	return fetch->path != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory for a part of a file");
}

void fetches_ask(struct session *session, uint32_t id, const struct psr_msg_fetch *msg)
{
	struct fetches *fetches = &session->fetches;
	struct fetch fetch = { .id = id, .offset = msg->offset, .hash = msg->file_hash,
		                   .end = msg->length > 0 ? msg->offset + msg->length : UINT64_MAX };
	struct psr_error error;
	const int code = find_file(&fetch, session, msg, &error);

	if (code != PSR_OK) {
		session->n_open--;
		conn_send_error(session->conn, id, 0, code, error.text);
		return;
	}
	fetches->fetch[(fetches->first + fetches->n++) % FETCHES_MAX] = fetch;
	session->all->n_fetches++;
	go_on(session);
}

int fetches_cancel(struct session *session, uint32_t id)
{
	struct fetches *fetches = &session->fetches;
	unsigned i = 0;

	while (i < fetches->n && fetches->fetch[(fetches->first + i) % FETCHES_MAX].id != id)
		i++;
	if (i == fetches->n)
		return 0;
	if (i == 0 && fetches->read != NULL) {
		fetches->read->session = NULL;
		fetches->read = NULL;
	}
	/* The ones before it move up by one, and it is the first. */
	for (; i > 0; i--) {
		struct fetch *at = &fetches->fetch[(fetches->first + i) % FETCHES_MAX];
		struct fetch *before = &fetches->fetch[(fetches->first + i - 1) % FETCHES_MAX], cancelled = *at;

		*at = *before;
		*before = cancelled;
	}
	take_off(session);
	conn_drop(session->conn, id, 0, NULL, NULL);
	go_on(session);
	return 1;
}

void fetches_refuse(struct session *session, int code, const char *text)
{
	if (session->fetches.read != NULL)
		session->fetches.read->session = NULL;
	session->fetches.read = NULL;
	while (session->fetches.n > 0)
		refuse_first(session, code, text);
}

void fetches_forget(struct session *session)
{
	if (session->fetches.read != NULL)
		session->fetches.read->session = NULL;
	session->fetches.read = NULL;
	while (session->fetches.n > 0)
		take_off(session);
}

void fetches_pump(struct sessions *all)
{
	if (all->n_fetches == 0)
		return;
	for (struct conn *conn = all->conns->first; conn != NULL; conn = conn->next)
		if (conn->session != NULL)
			go_on(conn->session);
}

void fetches_fini(struct sessions *all)
{
	while (all->reads != NULL)
		destroy(all->reads);
}
