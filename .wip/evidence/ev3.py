from ev2 import *
class Case3(Case2):
    def __init__(s,path,tau=1.2):
        super().__init__(path); s.tau=tau
        # noise a channel by second differences of neighbouring samples, least over candidates
        nch=len(s.h['channels']); s.n=[[None]*nch for _ in range(s.T)]
        for ch in range(nch):
            best=None
            for c in s.c:
                d=[]
                for t in range(s.T):
                    idx=s.idx[t][ch]
                    if len(idx)<5: continue
                    r=c['raw'][t][idx]/s.h['trials'][t]['weight'][idx]
                    d.append((r[1:-1]-0.5*(r[:-2]+r[2:]))/np.sqrt(1.5))
                if not d: continue
                d=np.concatenate(d); v=1.4826*np.median(np.abs(d))
                v=max(v,1e-9)
                if best is None or v<best: best=v
            for t in range(s.T):
                idx=s.idx[t][ch]
                stated=np.median(s.h['trials'][t]['noise'][idx]) if len(idx) else 0
                s.n[t][ch]=best if best else stated
    def white(s,c,a,kappa,b,tau,taus=None):
        out=[]
        for t,tr in enumerate(s.h['trials']):
            S=c['s'][t] if c['s'] else tr['s']; J=c['jacobian'][t]
            M=np.column_stack([c['raw'][t],S,J]) if J.size else np.column_stack([c['raw'][t],S])
            M=M/tr['weight'][:,None]
            sh=(c['raw'][t]-s.nom['raw'][t])/tr['weight']
            X=np.zeros_like(M); ld=0
            for ch,idx in enumerate(s.idx[t]):
                if len(idx)==0: continue
                m=tr['model'][idx]; n=s.n[t][ch]
                n2=np.full(len(idx),(n*b)**2)*s.rmin2[t][idx]
                p2=a*a*(m*m+(0.3*n)**2)+kappa**2*sh[idx]**2
                p=np.sqrt(p2); tt=tr['t'][idx]
                K=np.exp(-np.abs(tt[:,None]-tt[None,:])/tau)*np.outer(p,p)
                K[np.diag_indices(len(idx))]+=n2
                L=cholesky(K,lower=True)
                X[idx]=solve_triangular(L,M[idx],lower=True); ld+=2*np.log(np.diag(L)).sum()
            m=S.shape[1]; out.append((X[:,0],X[:,1:1+m],X[:,1+m:],ld))
        return out
    @property
    def rmin2(s):
        if not hasattr(s,'_r2'):
            s._r2=[]
            for t,tr in enumerate(s.h['trials']):
                v=np.ones(len(tr['t']))
                for ch,idx in enumerate(s.idx[t]):
                    if len(idx)==0: continue
                    R=np.array([np.abs(c['raw'][t][idx]/tr['weight'][idx])/np.hypot(s.n[t][ch],tr['model'][idx]) for c in s.c]).min(0)
                    v[idx]=np.maximum(1,R/4)**2
                s._r2.append(v)
        return s._r2
    def best(s,c,kmu=np.log(0.15),ks=0.9,amu=0.0,as_=0.7):
        A=[0.4,1,2.2,5,12,30]; Kp=[0.03,0.1,0.2,0.4,0.8] if c['effects'] else [0.1]
        out=(-1e99,)
        for a in A:
            for k in Kp:
                v=s.score(c,a=a,kappa=k,b=1,tau=s.tau)-0.5*((np.log(a)-amu)/as_)**2-(0.5*((np.log(k)-kmu)/ks)**2 if c['effects'] else 0)
                if v>out[0]: out=(v,a,k)
        return out
